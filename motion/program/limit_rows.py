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
    equalities, of unit norm, zero where decided. scales (J, R): 1/norm before, 1 where decided. least (J, R): the least
    scale of a row of the same quantity, the one that moves most. decided (J, R): the equalities alone say where this
    control point lies.
    """

    matrix: list[np.ndarray]
    scales: np.ndarray
    least: np.ndarray
    decided: np.ndarray


@lru_cache(maxsize=32)
def limit_rows(equalities: Equalities, hull: Hull) -> LimitRows:
    """Return the rows of a hull's control points beside the equalities."""
    each = [_projected(hull, span) for span in equalities.spans]
    matrices, *rest = zip(*(each[k] for k in equalities.kind), strict=True)
    return LimitRows(list(matrices), *map(np.array, rest))


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
    return matrix, scales, least[hull.quantity], decided
