"""The optima of all joints, verified from their weights."""

from dataclasses import dataclass

import numpy as np

from motion.errors import SolverFailed
from motion.program.constraint_generation import Solution, solve
from motion.program.contradiction import InfeasibleRows
from motion.program.effort import Effort
from motion.program.problem import Problem

WARM_SHARE = 0.25
"""Effort of a warm start, as a part of the effort that is left; it is not subtracted from the effort of a cold start.
"""

EQUALITY_TOLERANCE = 1e-10
"""Largest residual of an equality, relative to the largest target …"""

ROUNDING = 4 * np.finfo(float).eps
"""… or to the sum of the absolute terms of the equality."""


@dataclass(frozen=True, slots=True)
class WarmStart:
    """Active rows of a plan, an array for each joint, for a warm start of the next plan.

    Row side·R + i belongs to control point i of a hull with R = `points` control points.
    """

    points: int
    rows: list[np.ndarray]

    @staticmethod
    def of(problem: Problem, solution: Solution) -> "WarmStart":
        """The active rows of a solution."""
        points = len(problem.hull.s)
        return WarmStart(points, [rows % (2 * points) for rows in solution.rows])


def optimum(
    problem: Problem, effort: Effort, warm: WarmStart | None = None, joints: np.ndarray | None = None
) -> Solution:
    """Return the optimum of every joint or of the `joints` (n,). Raises InfeasibleRows or SolverFailed.

    If a warm start fails, a cold start follows: infeasibility is only concluded without the rows of an earlier motion.
    The warm start has an effort of its own.
    """
    if warm is not None and warm.points == len(problem.hull.s):
        try:
            return _verified(problem, solve(problem, Effort(WARM_SHARE * effort.left), warm.rows, joints))
        except (InfeasibleRows, SolverFailed):
            pass
    return _verified(problem, solve(problem, effort, None, joints))


def _verified(problem: Problem, found: Solution) -> Solution:
    """Check the equalities of a solution, whose limits are kept, and return it. Raises SolverFailed."""
    missed = abs(problem.equalities.missed(found.x, problem.targets))
    if missed.max(initial=0.0) <= EQUALITY_TOLERANCE:
        return found
    allowed = EQUALITY_TOLERANCE * np.maximum(1.0, abs(problem.targets).max(axis=1))[:, None]
    # Large weights that cancel each other, as in a very short motion, leave rounding errors.
    terms = np.matmul(abs(problem.equalities.rows), abs(found.x)[:, :, None])[:, :, 0]
    allowed = np.maximum(allowed, ROUNDING * terms)
    if not (missed <= allowed).all():
        joint = int((missed / allowed).max(axis=1).argmax())
        raise SolverFailed(joint, f"equalities are off by {missed[joint].max():.1e}")
    return found


def feasible(problem: Problem, joints: list[int], effort: Effort, rows: list[np.ndarray]) -> list[np.ndarray]:
    """Return the active rows of some joints' optima. Raises InfeasibleRows or SolverFailed, also for unclear results.

    rows: to begin with, an array for each of the J joints, from the same joints in another duration.
    """
    warm = rows if any(rows[joint].size for joint in joints) else None
    found = _verified(problem, solve(problem, effort, warm, np.array(joints), probe=True))
    return WarmStart.of(problem, found).rows
