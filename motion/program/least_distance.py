"""Least distance programming (Lawson and Hanson): the smallest step that keeps a few rows, by PIQP."""

import numpy as np
import piqp

UNBOUNDED = 1e6
"""Multipliers beyond this, where the largest violation is 1, belong to rows that contradict each other."""

TOLERANCE, TIGHT_TOLERANCE = 1e-8, 1e-11

MAX_ITERATIONS = 60
"""Good solves take 22 iterations or fewer."""


def least_distance(matrix: np.ndarray, excess: np.ndarray, tight: bool) -> tuple[np.ndarray, np.ndarray, str]:
    """Minimise ½|u|² subject to matrix·u ≤ −excess, for unit rows `matrix` (m, N).

    Returns u (N,), multipliers (m,), and "" or what went wrong. Solved for the multipliers λ ≥ 0, of which
    u = −matrixᵀλ: min ½λᵀGλ − excessᵀλ with the small Gram matrix G. What does not come out clearly is solved once more in
    u with tight settings; "infeasible" comes with the multipliers that show it.
    """
    if len(matrix) <= 2 * matrix.shape[1]:
        solver = _solver(TIGHT_TOLERANCE if tight else TOLERANCE)
        solver.settings.preconditioner_iter = 0
        solver.settings.tau = 0.995
        solver.setup(matrix @ matrix.T, -excess, None, None, None, None, None, np.zeros(len(excess)), None)
        if solver.solve() == piqp.PIQP_SOLVED:
            multipliers = solver.result.x.copy()
            if multipliers.max() < UNBOUNDED:  # False for NaN
                return -multipliers @ matrix, multipliers, ""
    return _primal(matrix, excess)


def _primal(matrix: np.ndarray, excess: np.ndarray) -> tuple[np.ndarray, np.ndarray, str]:
    """The same program in u, the form that recognises rows that cannot be met."""
    count = matrix.shape[1]
    solver = _solver(TIGHT_TOLERANCE)
    lower = np.full(len(excess), -np.inf)
    solver.setup(np.eye(count), np.zeros(count), None, None, np.asfortranarray(matrix), lower, -excess)
    outcome = solver.solve()
    multipliers = solver.result.z_u.copy()
    if outcome == piqp.PIQP_SOLVED and np.isfinite(solver.result.x).all():
        return solver.result.x.copy(), multipliers, ""
    return np.zeros(count), multipliers, "infeasible" if outcome == piqp.PIQP_PRIMAL_INFEASIBLE else outcome.name


def _solver(tolerance: float) -> piqp.DenseSolver:
    solver = piqp.DenseSolver()
    settings = solver.settings
    settings.max_iter = MAX_ITERATIONS
    settings.eps_abs = settings.eps_duality_gap_abs = tolerance
    settings.eps_rel = settings.eps_duality_gap_rel = tolerance / 10
    return solver
