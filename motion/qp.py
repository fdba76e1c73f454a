"""The small quadratic program behind each round: the shortest step that keeps a few rows (design 1.5, 1.7)."""

import numpy as np
import piqp
from scipy.linalg import get_lapack_funcs

_factorise, _rotate = get_lapack_funcs(("geqrf", "ormqr"), dtype=np.float64)  # np.linalg.qr takes four times as long
_TOLERANCES = {"loose": 1e-6, "tight": 1e-10}
_UNREACHED = 1e6
"""A bound this far away, in units of the largest violation, is none: PIQP would lose its way."""


def shortest_step(
    matrix: np.ndarray, lower: np.ndarray, upper: np.ndarray, precision: str
) -> tuple[np.ndarray, np.ndarray, str]:
    """min ½|u|² with lower ≤ matrix·u ≤ upper for `matrix` (m, N): u (N,), multipliers (m,), "" or what went wrong.

    Solved in the span of the rows, which holds the optimum. Anything but an optimum is tried once more, tight,
    by a fresh solver; "infeasible" comes with the multipliers that show it.
    """
    size = min(matrix.shape)
    factor, reflectors, _, _ = _factorise(matrix.T)
    triangle = np.asfortranarray(np.tril(factor[:size].T))
    x, multipliers, status = _solve_box(triangle, lower, upper, precision)
    padded = np.zeros((matrix.shape[1], 1), order="F")
    padded[:size, 0] = x
    u, _, _ = _rotate("L", "N", factor[:, :size], reflectors, padded, 64, overwrite_c=True)
    return u[:, 0], multipliers, status


def _solve_box(
    matrix: np.ndarray, lower: np.ndarray, upper: np.ndarray, precision: str
) -> tuple[np.ndarray, np.ndarray, str]:
    """min ½|x|² with lower ≤ matrix·x ≤ upper: x, multipliers and "" or what went wrong."""
    lower = np.where(lower < -_UNREACHED, -np.inf, lower)
    upper = np.where(upper > _UNREACHED, np.inf, upper)
    size = matrix.shape[1]
    status, multipliers = "", np.zeros(len(lower))
    for tolerance in {"loose": ("loose", "tight"), "tight": ("tight",)}[precision]:
        solver = _solver(tolerance)
        solver.setup(np.eye(size), np.zeros(size), None, None, matrix, lower, upper)
        outcome = solver.solve()
        result = solver.result
        multipliers = result.z_u - result.z_l
        if outcome == piqp.PIQP_SOLVED and np.isfinite(result.x).all():
            return result.x.copy(), multipliers, ""
        status = "infeasible" if outcome == piqp.PIQP_PRIMAL_INFEASIBLE else outcome.name
    return np.zeros(size), multipliers, status


def _solver(tolerance: str) -> piqp.DenseSolver:
    """Good solves take 22 iterations or fewer; the second try may take longer and scales its rows."""
    solver = piqp.DenseSolver()
    settings = solver.settings
    if tolerance == "loose":
        settings.max_iter = 60
        settings.preconditioner_iter = 0
        settings.tau = 0.995
    settings.eps_abs = settings.eps_duality_gap_abs = _TOLERANCES[tolerance]
    settings.eps_rel = settings.eps_duality_gap_rel = _TOLERANCES[tolerance] / 10
    return solver
