"""Constraint generation: the few limit rows that matter, found by solving, looking at all control points, and adding.

In u = z − z*, where z* belongs to the optimum without limits, the cost is |u|² and u runs in the null space of the
equalities. Joints are independent programs.
"""

from dataclasses import dataclass

import numpy as np

from motion.errors import SolverFailed
from motion.limits import SIGNS
from motion.program.effort import Effort
from motion.program.least_distance import INFEASIBLE, UNCLEAR, least_distance, least_distance_in_doubt
from motion.program.problem import Problem

MAX_ROUNDS = 30

DROPPING_ROUNDS = 6
"""Rows without a multiplier are dropped between these first rounds; the objective grows all the same, so it ends."""

NEAR = 20.0
"""Of a limit is what lies within this many times the distance at which rows are demanded."""

STRIDE, MANY = 3, 24
"""In the first round every third violated control point becomes a row, but not many more than so many."""

TINY = 1e-12
"""The scale of a program whose rows hold already."""

IDLE = 1e-8
"""A row whose multiplier is a smaller part of the largest carries none."""

NOTHING, NO_MULTIPLIERS = np.zeros(0, dtype=int), np.zeros(0)


class InfeasibleRows(Exception):
    """The rows of one joint contradict each other; `quantity` (0 to 3) and `s` of the one hardest pressed."""

    def __init__(self, joint: int, quantity: int, s: float) -> None:
        super().__init__(f"joint {joint}: limits contradict each other")
        self.joint = joint
        self.quantity = quantity
        self.s = s


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """The optimum of one joint: the motion x (N + 2,), the rows that it was solved with and their multipliers.

    Row side·R + i keeps control point i above its lower (side 0) or below its upper limit (side 1). `near` are the rows
    whose limits the motion comes near.
    """

    joint: int
    x: np.ndarray
    rows: np.ndarray
    multipliers: np.ndarray
    near: np.ndarray
    rounds: int


def solve(
    problem: Problem,
    effort: Effort,
    warm: list[np.ndarray] | None = None,
    joints: np.ndarray | None = None,
    probe: bool = False,
) -> list[Solution]:
    """For each joint, or each of the `joints` (n,), the motion nearest to the adapted demonstration inside all limits.

    All control points of what is returned lie inside their limits, those that the equalities decide to rounding. `warm`
    are rows to begin with, an array for each of the J joints. In a `probe` what does not come out clearly counts as
    infeasible. Raises InfeasibleRows where the limits cannot be kept, SolverFailed for numerical trouble or too much
    effort.
    """
    chosen = np.arange(len(problem.origin)) if joints is None else joints
    _check_decided(problem, chosen)
    outside: list[bool] = (problem.room < 0).any(axis=(1, 2)).tolist()  # type: ignore[assignment]
    return [
        _solve(problem, joint, effort, None if warm is None else warm[joint], probe)
        if outside[joint]
        else Solution(joint, problem.origin[joint], NOTHING, NO_MULTIPLIERS, NOTHING, 0)
        for joint in chosen.tolist()
    ]


def _check_decided(problem: Problem, joints: np.ndarray) -> None:
    """Raise InfeasibleRows for a control point that the equalities hold outside its limit."""
    beyond = problem.beyond[joints]
    if (beyond > 0).any():
        joint, point = np.unravel_index(beyond.argmax(), beyond.shape)
        hull = problem.hull
        raise InfeasibleRows(int(joints[joint]), int(hull.quantity[point]), float(hull.s[point]))


def _solve(problem: Problem, joint: int, effort: Effort, warm: np.ndarray | None, probe: bool) -> Solution:
    """The optimum of one joint that leaves its limits where it ignores them."""
    matrix, room = problem.limit_rows.matrix[joint], problem.room[joint].ravel()
    inside = problem.inside[joint]
    over = -room
    rows, multipliers, rounds, u = NOTHING, NO_MULTIPLIERS, 0, np.zeros(matrix.shape[1])
    new = _first(over) if warm is None or not warm.size else warm
    while new.size:
        rounds += 1
        if rounds > MAX_ROUNDS:
            raise SolverFailed(joint, f"no end after {MAX_ROUNDS} rounds")
        if rounds <= DROPPING_ROUNDS:
            rows = rows[multipliers > IDLE * multipliers.max(initial=0.0)]
        rows = np.array(sorted({*rows.tolist(), *new.tolist()}))
        effort.spend(joint, len(rows))
        program, size = _program(matrix, room, inside, rows)
        u, multipliers, status = least_distance(*program, tight=rounds > DROPPING_ROUNDS or problem.precise)
        if status == UNCLEAR and not probe:
            effort.spend_on_doubt(joint, len(rows), len(u))
            u, multipliers, status = least_distance_in_doubt(*program)
        if status == INFEASIBLE or (status and probe):
            raise _contradiction(problem, joint, rows, multipliers)
        if status:
            raise SolverFailed(joint, status)
        u *= size
        moved = matrix @ u
        over = np.concatenate([-moved, moved]) - room
        new = _peaks(over)
    x = problem.origin[joint].copy()
    x[:-2] += u
    near = (over > -NEAR * np.concatenate([inside, inside])).nonzero()[0]
    return Solution(joint, x, rows, multipliers, near, rounds)


def _program(
    matrix: np.ndarray, room: np.ndarray, inside: np.ndarray, rows: np.ndarray
) -> tuple[tuple[np.ndarray, np.ndarray], float]:
    """The least distance program of some rows, scaled so that the largest violation is 1, and the scale."""
    side, point = np.divmod(rows, len(inside))
    excess = inside[point] - room[rows]
    size = max(float(excess.max()), TINY)
    return (matrix[point] * SIGNS[side, None], excess / size), size


def _first(over: np.ndarray) -> np.ndarray:
    """Rows at the peaks of positive `over` (2R,), and some along each stretch."""
    positive = (over > 0).nonzero()[0]
    along = positive[positive % max(STRIDE, len(positive) // MANY) == 0]
    return np.union1d(_peaks(over), along)


def _peaks(over: np.ndarray) -> np.ndarray:
    """Rows at the peaks of positive `over` (2R,)."""
    positive = (over > 0).nonzero()[0]
    above = over[positive]
    return positive[(above >= over.take(positive - 1)) & (above >= over.take(positive + 1, mode="clip"))]


def _contradiction(problem: Problem, joint: int, rows: np.ndarray, multipliers: np.ndarray) -> InfeasibleRows:
    """Name the quantity with the largest sum of multipliers, and where its largest is."""
    point = rows % len(problem.hull.s)
    quantity = problem.hull.quantity[point]
    hardest = np.bincount(quantity, weights=multipliers, minlength=4).argmax()
    worst = np.where(quantity == hardest, multipliers, -1.0).argmax()
    return InfeasibleRows(joint, int(hardest), float(problem.hull.s[point[worst]]))
