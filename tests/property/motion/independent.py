"""The solver that plans are held against."""

from ctypes import c_int

import daqp
import numpy as np
from hypothesis import assume


def nearest_to_zero(matrix: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray | None:
    """DAQP's smallest u with lower ≤ matrix·u ≤ upper, sides that are infinite included; None where there is none."""
    norms = np.linalg.norm(matrix, axis=1)
    high, low = np.minimum(upper / norms, 1e29), np.maximum(lower / norms, -1e29)
    size, sense = matrix.shape[1], np.zeros(len(matrix), dtype=c_int)
    rows = np.ascontiguousarray(matrix / norms[:, None])
    u, _, flag, _ = daqp.solve(np.eye(size), np.zeros(size), rows, high, low, sense, primal_tol=1e-9)
    assume(flag in (1, -1))  # neither cycling nor out of iterations
    return u if flag == 1 else None
