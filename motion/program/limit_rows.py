"""The limit rows of a spline space: how its control points move in the null space of the equalities."""

from dataclasses import dataclass

import numpy as np

from motion.limits import SIGNS
from motion.program.cache import cached_within
from motion.program.equalities import Equalities
from motion.program.space import QUANTITIES, Hull

DETERMINED = 1e-9
"""The equalities determine a control point if the part of its row outside their span is smaller than this."""


KINDS = 2 * QUANTITIES + 1
"""Number of kinds of bounds: the limit of each quantity, the final acceleration's own, and the limit of each quantity
for control points that the equalities determine."""


@dataclass(frozen=True, slots=True, eq=False)
class LimitRows:
    """Rows of R control points of J joints, one for each side: how far a step u moves the control point.

    matrix (K, R, N): for each kind of equalities, projected onto their null space, of unit norm, zero where decided.
    kind (J,): the kind of each joint. place (J, 2, R): index of each row in (K·R, N). scales (J, R): 1/norm before
    normalisation, 1 where decided. least (J, 4): least scale of the rows of each quantity, which belongs to the row
    that moves most. bound (J, 2, R): index of each row's bound in (J, 2, KINDS). decided: flat indices in (J, 2, R) of
    the control points that the equalities determine.
    """

    matrix: np.ndarray
    kind: np.ndarray
    place: np.ndarray
    scales: np.ndarray
    least: np.ndarray
    bound: np.ndarray
    decided: np.ndarray

    def at(self, rows: np.ndarray) -> np.ndarray:
        """Rows (n, N) at flat indices (n,) in (J, 2, R), with the sign of their side."""
        matrix = self.matrix.reshape(-1, self.matrix.shape[2]).take(self.place.take(rows), axis=0)
        matrix *= SIGNS.take((rows // self.scales.shape[1]) & 1)[:, None]
        return matrix

    def moved(self, joints: list[int], steps: np.ndarray) -> np.ndarray:
        """Distances (n, 2, R), towards each side, by which steps u (n, N) of `joints` move their control points."""
        if len(self.matrix) == 1:
            moved = steps @ self.matrix[0].T
        else:
            moved = np.array([self.matrix[self.kind[joint]] @ u for joint, u in zip(joints, steps, strict=True)])
        return SIGNS[:, None] * moved[:, None]


@cached_within(128_000_000)
def limit_rows(equalities: Equalities, hull: Hull) -> LimitRows:
    """Return the rows of a hull's control points in the null space of the equalities."""
    own = zip(equalities.spans, equalities.changes, strict=True)
    each = zip(*(_projected(hull, span, change) for span, change in own), strict=True)
    matrix, *of_kinds = map(np.array, each)
    scales, least, decided = (values[equalities.kind] for values in of_kinds)
    which = hull.quantity + (QUANTITIES + 1) * decided
    last = hull.last_acceleration
    which[:, last] = np.where(decided[:, last], which[:, last], QUANTITIES)
    joints, points = which.shape
    bound = which[:, None] + KINDS * np.arange(2 * joints).reshape(-1, 2, 1)
    both = np.repeat(decided[:, None], 2, axis=1).ravel().nonzero()[0]
    kind = np.array(equalities.kind)
    place = np.repeat(points * kind[:, None] + np.arange(points), 2, axis=0).reshape(bound.shape)
    return LimitRows(matrix, kind, place, scales, least, bound, both)


def _projected(
    hull: Hull, span: np.ndarray, change: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Matrix, scales, least and decided of one kind of equalities."""
    points = hull.points[:, :-2] if change is None else hull.points[:, :-2] @ change
    full = hull.rows[:, :-2] if change is None else hull.insertion @ points
    # Projected before the insertion, because the space has fewer control points than the hull.
    matrix = hull.insertion @ (points - (points @ span) @ span.T)
    left = np.einsum("ij,ij->i", matrix, matrix)
    decided = left <= DETERMINED**2 * np.einsum("ij,ij->i", full, full)
    scales = 1 / np.sqrt(np.where(decided, 1.0, left))
    least = np.full(QUANTITIES, np.inf)
    np.minimum.at(least, hull.quantity[~decided], scales[~decided])
    matrix *= scales[:, None]
    matrix[decided] = 0.0
    return matrix, scales, least, decided
