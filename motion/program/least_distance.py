"""Least distance programming (Lawson and Hanson) by PIQP: the smallest step that satisfies a few rows.

The dual is solved for the multipliers λ ≥ 0; the step is u = −matrixᵀλ.
"""

from functools import lru_cache
from threading import get_ident

import numpy as np
import piqp

UNBOUNDED = 1e6
"""Multipliers above this, with a largest violation of 1, are not accepted as an optimum."""

TOLERANCE, TIGHT_TOLERANCE = 1e-7, 1e-11

MAX_ITERATIONS = 60
"""Iterations of the solver; successful solves take at most 27."""

SOLVED, INFEASIBLE, UNCLEAR = "", "infeasible", "unclear"

Answer = tuple[np.ndarray, str]
"""Multipliers (m,) and a status; the multipliers of an infeasible program are a certificate of infeasibility."""


def least_distance(matrix: np.ndarray, excess: np.ndarray, tight: bool) -> Answer:
    """Minimise ½|u|² subject to matrix·u ≤ −excess, for unit rows `matrix` (m, N).

    The multipliers minimise ½λᵀGλ − excessᵀλ with the small Gram matrix G.
    """
    solver = _dual_solver(len(excess), tight, get_ident())
    solver.update((matrix @ matrix.T).T, -excess)
    outcome = solver.solve()
    multipliers = solver.result.x.copy()
    if outcome == piqp.PIQP_SOLVED and multipliers.max() < UNBOUNDED:  # False for NaN
        return multipliers, SOLVED
    return multipliers, INFEASIBLE if outcome == piqp.PIQP_DUAL_INFEASIBLE else UNCLEAR


def least_distance_in_doubt(matrix: np.ndarray, excess: np.ndarray) -> Answer:
    """Solve the same program in u: slower, for programs whose dual had an unclear status.

    Returns the solver's own status if it fails.
    """
    count = matrix.shape[1]
    solver = make_solver(TIGHT_TOLERANCE, TIGHT_TOLERANCE / 10)
    lower = np.full(len(excess), -np.inf)
    solver.setup(np.eye(count), np.zeros(count), None, None, np.asfortranarray(matrix), lower, -excess)
    outcome = solver.solve()
    multipliers = solver.result.z_u.copy()
    if outcome == piqp.PIQP_SOLVED and np.isfinite(multipliers).all():
        return multipliers, SOLVED
    return multipliers, INFEASIBLE if outcome == piqp.PIQP_PRIMAL_INFEASIBLE else outcome.name


@lru_cache(maxsize=128)
def _dual_solver(size: int, tight: bool, _: int) -> piqp.DenseSolver:
    """Return a solver for `size` multipliers, made once a thread.

    Its setup takes half of the time of a small program. Earlier solutions do not influence later ones.
    """
    tolerance = TIGHT_TOLERANCE if tight else TOLERANCE
    solver = make_solver(tolerance, tolerance / 10)
    solver.settings.preconditioner_iter = 0
    solver.settings.tau = 0.995
    solver.setup(np.eye(size), np.zeros(size), None, None, None, None, None, np.zeros(size), None)
    return solver


def make_solver(tolerance: float, relative: float) -> piqp.DenseSolver:
    """Return a solver with absolute and relative tolerances."""
    solver = piqp.DenseSolver()
    settings = solver.settings
    settings.max_iter = MAX_ITERATIONS
    settings.eps_abs = settings.eps_duality_gap_abs = tolerance
    settings.eps_rel = settings.eps_duality_gap_rel = relative
    return solver
