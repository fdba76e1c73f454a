"""The small quadratic program behind each round: the shortest step that keeps a few rows (design 1.5, 1.7)."""

import numpy as np
import piqp

_UNBOUNDED = 1e6
"""Multipliers beyond this, where the largest violation is 1, belong to rows that contradict each other."""


def shortest_step(matrix: np.ndarray, excess: np.ndarray, precise: bool) -> tuple[np.ndarray, np.ndarray, str]:
    """min ½|u|² with matrix·u ≤ −excess for unit rows `matrix` (m, N): u (N,), multipliers (m,), "" or what went wrong.

    Solved for the multipliers λ ≥ 0, of which u = −matrixᵀλ: min ½λᵀGλ − excessᵀλ with the small Gram matrix G. What
    does not come out clearly is tried once more as it stands, by a fresh solver with tight settings; "infeasible" comes
    with the multipliers that show it.
    """
    gram = matrix @ matrix.T
    solver = _solver(1e-10 if precise else 1e-7, scaled=False)
    solver.setup(gram, -excess, None, None, None, None, None, np.zeros(len(excess)), None)
    if solver.solve() == piqp.PIQP_SOLVED:
        multipliers = solver.result.x.copy()
        if multipliers.max() < _UNBOUNDED:  # False for NaN
            return -multipliers @ matrix, multipliers, ""
    return _as_it_stands(matrix, excess)


def _as_it_stands(matrix: np.ndarray, excess: np.ndarray) -> tuple[np.ndarray, np.ndarray, str]:
    """The same program in u, with tight settings; the form that knows what cannot be met."""
    count = matrix.shape[1]
    solver = _solver(1e-10, scaled=True)
    lower = np.full(len(excess), -np.inf)
    solver.setup(np.eye(count), np.zeros(count), None, None, np.asfortranarray(matrix), lower, -excess)
    outcome = solver.solve()
    multipliers = solver.result.z_u.copy()
    if outcome == piqp.PIQP_SOLVED and np.isfinite(solver.result.x).all():
        return solver.result.x.copy(), multipliers, ""
    return np.zeros(count), multipliers, "infeasible" if outcome == piqp.PIQP_PRIMAL_INFEASIBLE else outcome.name


def _solver(tolerance: float, scaled: bool) -> piqp.DenseSolver:
    """Good solves take 22 iterations or fewer; the second try may take longer and scales its rows."""
    solver = piqp.DenseSolver()
    settings = solver.settings
    if not scaled:
        settings.max_iter = 60
        settings.preconditioner_iter = 0
        settings.tau = 0.995
    settings.eps_abs = settings.eps_duality_gap_abs = tolerance
    settings.eps_rel = settings.eps_duality_gap_rel = tolerance / 10
    return solver
