"""The limit rows of a spline space: how its control points move when the equalities are kept."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from motion.program.equalities import Equalities
from motion.program.space import QUANTITIES, Hull

DEAD = 1e-9
"""A row with less than this part of itself outside the span of the equalities is decided by them."""


@dataclass(frozen=True, slots=True, eq=False)
class LimitRows:
    """One row for each of R control points, for each of J joints: what a step u of z does to it.

    matrix: for each joint (R, N), shared where the equalities are alike: projected onto the null space of the
    equalities, of unit norm, zero where decided. scales (J, R): 1/norm before, 1 where decided. least (J, 4): the least
    scale of a row of each quantity, that of the row that moves most. decided: flat indices in (J, 2, R) of the limits
    of control points that the equalities alone place; width_of: for each of them the flat index in (J, 4) of its joint
    and quantity.
    """

    matrix: list[np.ndarray]
    scales: np.ndarray
    least: np.ndarray
    decided: np.ndarray
    width_of: np.ndarray


@lru_cache(maxsize=32)
def limit_rows(equalities: Equalities, hull: Hull) -> LimitRows:
    """Return the rows of a hull's control points beside the equalities."""
    each = [_projected(hull, span) for span in equalities.spans]
    matrices, *rest = zip(*(each[k] for k in equalities.kind), strict=True)
    scales, least, decided = map(np.array, rest)
    joint, side, point = np.repeat(decided[:, None], 2, axis=1).nonzero()
    flat = np.ravel_multi_index((joint, side, point), (len(scales), 2, scales.shape[1]))
    return LimitRows(list(matrices), scales, least, flat, QUANTITIES * joint + hull.quantity[point])


def _projected(hull: Hull, span: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Matrix, scales, least and decided of one kind of equalities."""
    full = hull.rows[:, :-2]
    matrix = full - (full @ span) @ span.T
    left = np.einsum("ij,ij->i", matrix, matrix)
    decided = left <= DEAD**2 * np.einsum("ij,ij->i", full, full)
    scales = 1 / np.sqrt(np.where(decided, 1.0, left))
    least = np.full(QUANTITIES, np.inf)
    np.minimum.at(least, hull.quantity[~decided], scales[~decided])
    matrix *= scales[:, None]
    matrix[decided] = 0.0
    return matrix, scales, least, decided
