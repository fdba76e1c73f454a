"""Constraint generation: solve with a few limit rows, add the rows that the solution violates, and repeat.

In u = z − z*, where z* is the optimum without limits, the cost is |u|² and u lies in the null space of the equalities.
z are the weights whitened in the joint's own metric if it has one. Joints are independent programs; the violations of
all joints are found together.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from motion.errors import SolverFailed
from motion.program.contradiction import InfeasibleRows, hardest_limit
from motion.program.effort import CUBE, FULL_SOLVE, PROGRAM, Effort
from motion.program.least_distance import INFEASIBLE, UNCLEAR, least_distance, least_distance_in_doubt
from motion.program.limit_rows import KINDS
from motion.program.problem import Problem
from motion.program.space import QUANTITIES

MAX_ROUNDS = 30

DROPPING_ROUNDS = 6
"""Rows without a multiplier are dropped in the rounds before this one. The objective still increases in every round, so
the iteration ends."""

MANY_ROWS = 45
"""A joint that begins with more rows than this is often infeasible. It is solved first and alone; the other joints are
solved together."""

STRIDE, MANY_VIOLATED = 3, 24
"""In the first round every third violated control point also becomes a row; with more than about `MANY_VIOLATED` of
them, fewer."""

NEIGHBOURS, ALONE = np.array([-1, 0, 1]), np.array([0])
"""Offsets of the rows that a warm-started row adds, in a plan and in a probe."""

TINY = 1e-12
"""Scale of a program without violated rows."""

INACTIVE = 1e-8
"""Multipliers below this part of the largest count as zero."""

LARGEST_STEP = 1e3
"""A contradiction excludes steps up to this many times the largest violation."""

NO_ROWS, NO_MULTIPLIERS = np.zeros(0, dtype=int), np.zeros(0)


@dataclass(slots=True, eq=False)
class Solution:
    """The optima of J joints: motions and active rows.

    x: (J, N + 2). rows, multipliers: for each joint, the rows with a multiplier, and the multipliers. A row is a flat
    index in (J, 2, R): row (side, i) keeps control point i above its lower limit (side 0) or below its upper limit
    (side 1). rounds: number of programs solved for each joint. size: number of rows of the largest program.
    """

    x: np.ndarray
    rows: list[np.ndarray]
    multipliers: list[np.ndarray]
    rounds: list[int]
    size: int = 0

    def replace(self, other: "Solution", joints: np.ndarray) -> None:
        """Replace the optima of some `joints` by later ones."""
        self.x[joints] = other.x[joints]
        for joint in joints.tolist():
            self.rows[joint], self.multipliers[joint] = other.rows[joint], other.multipliers[joint]
            self.rounds[joint] = max(self.rounds[joint], other.rounds[joint])
        self.size = max(self.size, other.size)


def solve(
    problem: Problem,
    effort: Effort,
    warm: list[np.ndarray] | None = None,
    joints: np.ndarray | None = None,
    probe: bool = False,
) -> Solution:
    """For all joints, or for `joints` (n,), find the motion nearest to the adapted demonstration inside all limits.

    All control points of the result lie inside their limits; those that the equalities determine, up to rounding. The
    other joints keep the optimum without limits. warm: rows to begin with, an array for each of the J joints. probe:
    treat an unclear solver status as infeasible. Raises InfeasibleRows if the limits cannot be kept, SolverFailed if
    the solver fails or the effort is spent.
    """
    count = len(problem.origin)
    chosen = np.arange(count) if joints is None else joints
    _check_decided(problem, chosen)
    found = Solution(problem.origin.copy(), [NO_ROWS] * count, [NO_MULTIPLIERS] * count, [0] * count)
    first = _violated(problem.over if joints is None else problem.over[joints], chosen, stretches=warm is None)
    if warm is None:
        groups = _hard_joints_first(first, problem.over[0].size)
    else:
        beside = _beside(problem, first, warm, ALONE if probe else NEIGHBOURS) if first.size else NO_ROWS
        groups = [np.concatenate([first, beside])]
    for new in groups:
        rounds = 0
        while new.size:
            rounds += 1
            new = _with_rows(problem, found, new, rounds, effort, probe)
    return found


def _check_decided(problem: Problem, joints: np.ndarray) -> None:
    """Raise InfeasibleRows if the equalities place a control point outside its limit."""
    hull, each = problem.hull, problem.limit_rows.decided
    beyond = problem.over.take(each)
    if not (beyond > 0).any():
        return
    beyond[~np.isin(each // (2 * len(hull.s)), joints)] = 0.0
    if (beyond > 0).any():
        row = int(each[beyond.argmax()])
        point = row % len(hull.s)
        where = row // (2 * len(hull.s)), int(hull.quantity[point]), float(hull.s[point])
        raise InfeasibleRows(*where, np.array([row]), np.ones(1))


def _hard_joints_first(first: np.ndarray, size: int) -> list[np.ndarray]:
    """Divide the first rows of all joints, `size` a joint, into those of each hard joint and those of all the rest."""
    which = first // size
    hard = np.bincount(which) > MANY_ROWS
    each = [first[which == joint] for joint in hard.nonzero()[0].tolist()]
    return [*each, first[~hard[which]]] if each else [first]


def _with_rows(
    problem: Problem, found: Solution, new: np.ndarray, rounds: int, effort: Effort, probe: bool
) -> np.ndarray:
    """Solve the programs of some joints with the `new` rows added; return the rows that the solutions violate."""
    size, limit_rows = problem.over[0].size, problem.limit_rows
    each = sorted({*(new // size).tolist()})
    joints = np.array(each)
    rows = np.concatenate([*(found.rows[joint] for joint in each), new])
    rows.sort()
    if (rows[1:] == rows[:-1]).any():
        rows = np.unique(rows)
    begins = rows.searchsorted(size * joints)
    spans = list(pairwise([*begins.tolist(), len(rows)]))
    sizes = [end - begin for begin, end in spans]
    matrix, excess = _program(problem, rows)
    # Scaled so that the largest violation of each joint is 1.
    scales = np.maximum(np.maximum.reduceat(excess, begins), TINY)
    excess /= scales.repeat(sizes)
    multipliers = np.empty(len(rows))
    for joint, (begin, end) in zip(each, spans, strict=True):
        if rounds > MAX_ROUNDS:
            raise SolverFailed(joint, f"no end after {MAX_ROUNDS} rounds")
        effort.spend(joint, PROGRAM + CUBE * (end - begin) ** 3)
        program = matrix[begin:end], excess[begin:end]
        tight = problem.precise or rounds > DROPPING_ROUNDS
        multipliers[begin:end], status = least_distance(*program, tight=tight)
        if status == UNCLEAR and not probe:
            effort.spend(joint, FULL_SOLVE * program[0].size)
            multipliers[begin:end], status = least_distance_in_doubt(*program)
        if status == INFEASIBLE or (status and probe):
            raise _contradiction(problem, joint, rows[begin:end], multipliers[begin:end])
        if status:
            raise SolverFailed(joint, status)
        found.rounds[joint] = rounds
    found.size = max(found.size, *sizes)
    steps = np.add.reduceat(multipliers[:, None] * matrix, begins) * -scales[:, None]
    if rounds < DROPPING_ROUNDS:
        carrying = multipliers > (INACTIVE * np.maximum.reduceat(multipliers, begins)).repeat(sizes)
        rows, multipliers = rows[carrying], multipliers[carrying]
    ends = rows.searchsorted(size * (joints + 1)).tolist()
    for joint, begin, end in zip(each, [0, *ends], ends, strict=False):
        found.rows[joint], found.multipliers[joint] = rows[begin:end], multipliers[begin:end]
    found.x[joints, :-2] = problem.origin[joints, :-2] + problem.equalities.steps(each, steps)
    over = limit_rows.moved(each, steps)
    over += problem.over[joints]
    return _violated(over, joints)


def _beside(problem: Problem, violated: np.ndarray, warm: list[np.ndarray], offsets: np.ndarray) -> np.ndarray:
    """The `warm` rows of joints that violate some row, with `offsets` because the active rows may have moved there."""
    bound, size = problem.limit_rows.bound, problem.over[0].size
    each = [warm[joint] + joint * size for joint in np.unique(violated // size).tolist()]
    rows = (np.concatenate(each)[:, None] + offsets).ravel() % bound.size
    return rows[bound.take(rows) % KINDS <= QUANTITIES]


def _violated(over: np.ndarray, joints: np.ndarray, stretches: bool = False) -> np.ndarray:
    """Return flat indices in (J, 2, R) of the rows of `joints` (n,) at the peaks of positive `over` (n, 2, R).

    stretches: also some rows along each stretch where `over` is positive. The flat neighbours of a row may belong to
    the next joint. This is harmless: a joint's first control point is its prescribed start.
    """
    flat, size = over.ravel(), over[0].size
    positive = (flat > 0).nonzero()[0]
    if not positive.size:
        return positive
    above = flat[positive]
    wanted = above >= flat[positive - 1]
    wanted &= above >= flat.take(positive + 1, mode="clip")
    if stretches:
        which, rows = np.divmod(positive, size)
        strides = np.maximum(STRIDE, np.bincount(which) // MANY_VIOLATED)
        wanted |= rows % strides[which] == 0
    found = positive[wanted]
    return found + size * (joints - np.arange(len(joints))).take(found // size)


def _contradiction(problem: Problem, joint: int, rows: np.ndarray, multipliers: np.ndarray) -> InfeasibleRows:
    point = rows % len(problem.hull.s)
    where = hardest_limit(problem.hull.quantity[point], problem.hull.s[point], multipliers)
    return InfeasibleRows(joint, *where, rows, multipliers)


def refutes(problem: Problem, rows: np.ndarray, multipliers: np.ndarray) -> bool:
    """Whether rows (n,) that contradicted each other in another duration do so in this one too, by their multipliers.

    With M·u ≤ −e and λ ≥ 0, −|Mᵀλ||u| ≤ λᵀMu ≤ −λᵀe, so a small |Mᵀλ| excludes all steps u that are not too large.
    """
    matrix, excess = _program(problem, rows)
    return bool(multipliers @ excess > LARGEST_STEP * excess.max() * np.linalg.norm(multipliers @ matrix))


def _program(problem: Problem, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Matrix (n, N) and violations (n,) of some rows, tightened."""
    matrix, excess = problem.limit_rows.at(rows), problem.over.take(rows)
    excess += problem.inside.take(problem.limit_rows.bound.take(rows))
    return matrix, excess
