"""The independent solver with which plans are compared."""

from ctypes import c_int

import daqp
import numpy as np
from hypothesis import assume


class Inconclusive(Exception):
    """The solver cycled, or ran out of iterations."""


def smallest_step(matrix: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray | None:
    """DAQP's smallest u with lower ≤ matrix·u ≤ upper, where sides may be infinite; None if infeasible.

    Raises Inconclusive.
    """
    norms = np.linalg.norm(matrix, axis=1)
    high, low = np.minimum(upper / norms, 1e29), np.maximum(lower / norms, -1e29)
    size, sense = matrix.shape[1], np.zeros(len(matrix), dtype=c_int)
    rows = np.ascontiguousarray(matrix / norms[:, None])
    u, _, flag, _ = daqp.solve(np.eye(size), np.zeros(size), rows, high, low, sense, primal_tol=1e-9)
    if flag not in (1, -1):
        raise Inconclusive(f"DAQP's flag is {flag}")
    return u if flag == 1 else None


def nearest_to_zero(matrix: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray | None:
    """The same as `smallest_step`, in a property test, which skips inconclusive cases."""
    try:
        return smallest_step(matrix, lower, upper)
    except Inconclusive:
        assume(False)
        raise
