"""Constraint generation: the few limit rows that matter, found by solving, looking at all control points, and adding.

In u = z − z*, where z* belongs to the optimum without limits, the cost is |u|² and u runs in the null space of the
equalities; z is that of the joint's own metric where it has one. Joints are independent programs; their control points
are looked at together.
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

HARD = 30
"""A joint that begins with more rows is often infeasible, and goes first, alone; the others take their rounds together.
"""

STRIDE, MANY = 3, 24
"""In the first round every third violated control point becomes a row, but not many more than so many."""

BESIDE = np.array([-1, 0, 1])
"""A row of an earlier motion brings these with it."""

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


@dataclass(slots=True, eq=False)
class Solution:
    """The optima of n joints: motions, control points, active rows.

    x: (n, N + 2). values: control points (n, R). For each joint, the rows that carry a multiplier, and the multipliers.
    Row side·R + i keeps control point i above its lower (side 0) or below its upper limit (side 1). rounds: programs
    that each joint took; size: rows of the largest.
    """

    joints: np.ndarray
    x: np.ndarray
    values: np.ndarray
    rows: list[np.ndarray]
    multipliers: list[np.ndarray]
    rounds: list[int]
    size: int = 0

    def replace(self, other: "Solution") -> None:
        """Put the optima of some joints in the places of those found before, in a solution of all joints."""
        self.x[other.joints], self.values[other.joints] = other.x, other.values
        for k, joint in enumerate(other.joints.tolist()):
            self.rows[joint], self.multipliers[joint] = other.rows[k], other.multipliers[k]
            self.rounds[joint] = max(self.rounds[joint], other.rounds[k])
        self.size = max(self.size, other.size)


def solve(
    problem: Problem,
    effort: Effort,
    warm: list[np.ndarray] | None = None,
    joints: np.ndarray | None = None,
    probe: bool = False,
) -> Solution:
    """For each joint, or each of the `joints` (n,), the motion nearest to the adapted demonstration inside all limits.

    All control points of what is returned lie inside their limits, those that the equalities decide to rounding. `warm`
    are rows to begin with, an array for each of the J joints. In a `probe` what does not come out clearly counts as
    infeasible. Raises InfeasibleRows where the limits cannot be kept, SolverFailed for numerical trouble or too much
    effort.
    """
    chosen = np.arange(len(problem.origin)) if joints is None else joints
    _check_decided(problem, chosen)
    n = len(chosen)
    none = [NOTHING] * n, [NO_MULTIPLIERS] * n, [0] * n
    found = Solution(chosen, problem.origin[chosen], problem.values[chosen], *none)
    first = _violated(problem.over[chosen], first=True)
    hard = [k for k, rows in first.items() if len(rows) > HARD]
    if warm is not None:
        first = {k: _beside(problem, chosen[k], warm[chosen[k]], rows) for k, rows in first.items()}
    for group in [*([k] for k in hard), [k for k in first if k not in hard]]:
        new = {k: first[k] for k in group}
        while new:
            _add_rows(problem, found, new, effort, probe)
            busy = list(new)
            found.values[busy] = values = found.x[busy] @ problem.hull.rows.T
            new = {busy[k]: rows for k, rows in _violated(problem.passed(values, chosen[busy])).items()}
    return found


def _check_decided(problem: Problem, joints: np.ndarray) -> None:
    """Raise InfeasibleRows for a control point that the equalities hold outside its limit."""
    outside = problem.beyond > 0
    if not outside.any():
        return
    hull, each = problem.hull, problem.limit_rows.decided
    beyond = np.where(np.isin(each // (2 * len(hull.s)), joints), problem.beyond, 0.0)
    if (beyond > 0).any():
        row = int(each[beyond.argmax()])
        point = row % len(hull.s)
        raise InfeasibleRows(row // (2 * len(hull.s)), int(hull.quantity[point]), float(hull.s[point]))


def _add_rows(problem: Problem, found: Solution, new: dict[int, list[int]], effort: Effort, probe: bool) -> None:
    """Solve the programs of some joints once more, with `new` rows."""
    which, sizes, rows = list(new), [], []
    joints = found.joints[which]
    for k, joint in zip(which, joints.tolist(), strict=True):
        found.rounds[k] += 1
        if found.rounds[k] > MAX_ROUNDS:
            raise SolverFailed(joint, f"no end after {MAX_ROUNDS} rounds")
        own = sorted({*found.rows[k].tolist(), *new[k]})
        effort.spend(joint, len(own))
        sizes.append(len(own))
        rows += own
    rows, of, ends = np.array(rows), joints.repeat(sizes), np.cumsum(sizes)
    side, point = np.divmod(rows, len(problem.hull.s))
    matrix = problem.limit_rows.matrix[problem.limit_rows.kind[of], point]
    matrix *= SIGNS[side, None]
    excess = problem.excess[of, side, point]
    # Scaled so that the largest violation of each joint is 1.
    scales = np.maximum(np.maximum.reduceat(excess, ends - sizes), TINY)
    excess /= scales.repeat(sizes)
    for k, joint, scale, size, end in zip(which, joints.tolist(), scales.tolist(), sizes, ends.tolist(), strict=True):
        part, dropping = slice(end - size, end), found.rounds[k] < DROPPING_ROUNDS
        program = matrix[part], excess[part]
        u, multipliers, status = least_distance(*program, tight=problem.precise or found.rounds[k] > DROPPING_ROUNDS)
        if status == UNCLEAR and not probe:
            effort.spend_on_doubt(joint, size, len(u))
            u, multipliers, status = least_distance_in_doubt(*program)
        if status == INFEASIBLE or (status and probe):
            raise _contradiction(problem, joint, rows[part], multipliers)
        if status:
            raise SolverFailed(joint, status)
        found.x[k, :-2] = problem.origin[joint, :-2] + problem.equalities.step(joint, scale * u)
        found.size = max(found.size, size)
        carrying = multipliers > (IDLE * multipliers.max() if dropping else -np.inf)
        found.rows[k], found.multipliers[k] = rows[part][carrying], multipliers[carrying]


def _beside(problem: Problem, joint: int, warm: np.ndarray, first: list[int]) -> list[int]:
    """The rows of an earlier motion, and their neighbours, to which they may have moved; the first ones without any."""
    excess = problem.excess[joint].ravel()
    rows = (warm[:, None] + BESIDE).ravel() % excess.size
    return rows[excess[rows] > -np.inf].tolist() or first


def _violated(over: np.ndarray, first: bool = False) -> dict[int, list[int]]:
    """Return the rows at the peaks of positive `over` (n, 2, R), by joint, for the joints that have some.

    The `first` time there are also some along each stretch. No peak reaches from one joint into the next: a joint's
    first control point is its start, which is fixed.
    """
    flat = over.ravel()
    positive = (flat > 0).nonzero()[0]
    if not positive.size:
        return {}
    above = flat[positive]
    wanted = above >= flat[positive - 1]
    wanted &= above >= flat.take(positive + 1, mode="clip")
    joints, rows = np.divmod(positive, over[0].size)
    if first:
        strides = np.maximum(STRIDE, np.bincount(joints) // MANY)
        wanted |= rows % strides[joints] == 0
    found: dict[int, list[int]] = {}
    for joint, row in zip(joints[wanted].tolist(), rows[wanted].tolist(), strict=True):
        found.setdefault(joint, []).append(row)
    return found


def _contradiction(problem: Problem, joint: int, rows: np.ndarray, multipliers: np.ndarray) -> InfeasibleRows:
    """Name the quantity with the largest sum of multipliers, and where its largest is."""
    point = rows % len(problem.hull.s)
    quantity = problem.hull.quantity[point]
    hardest = np.bincount(quantity, weights=multipliers, minlength=4).argmax()
    worst = np.where(quantity == hardest, multipliers, -1.0).argmax()
    return InfeasibleRows(joint, int(hardest), float(problem.hull.s[point[worst]]))
