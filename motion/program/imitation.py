"""The part of a demonstration that a motion imitates, as a motion of the spline space."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import cho_solve, cholesky

from motion import splines
from motion.primitive import Primitive
from motion.program.space import PLACE_TIME, at_nodes, make_space, nodes, quadrature


@dataclass(frozen=True, slots=True, eq=False)
class Imitated:
    """A part d of a demonstration in its own normalised time u from 0 to 1.

    duration: of the part when it was demonstrated, s. weights (J, N): of d″(u). control_points (J, N + 2): of d(u),
    rad. start (J, 2): d and d′ at u = 0, rad. nearest (J, N): weights of the projection of d″, which are `weights`
    unless the functions are too few to keep the positions with these. beyond (J,): ∫(d″ − Σwψ)² du of the projection,
    what no weights can imitate.
    """

    duration: float
    weights: np.ndarray
    control_points: np.ndarray
    start: np.ndarray
    nearest: np.ndarray
    beyond: np.ndarray

    def missed(self, weights: np.ndarray | float) -> np.ndarray:
        """∫(g″ − d″)² du (J,) of motions with other weights (J, N): a projection's error is orthogonal to them."""
        apart = weights - self.nearest
        return ((apart @ splines.gram(apart.shape[1], splines.ACCELERATION_DEGREE)) * apart).sum(axis=1) + self.beyond


def imitated(primitive: Primitive, begin: float, end: float, count: int) -> Imitated:
    """Return what lies between two phases, 0 ≤ begin < end ≤ 1, of a primitive, for `count` functions.

    With u from 0 to 1 in place of s from `begin` to `end`, d″(u) = (end − begin)²·d″(s). It is projected onto the
    functions, except where they are the demonstration's own: in its accelerations, or, on fewer functions, in the
    metric that keeps its positions too.
    """
    if (begin, end) == (0.0, 1.0):
        return _whole(primitive, count)
    return _part(primitive, begin, end, count)


@lru_cache(maxsize=64)
def _whole(primitive: Primitive, count: int) -> Imitated:
    return _part(primitive, 0.0, 1.0, count)


def _part(primitive: Primitive, begin: float, end: float, count: int) -> Imitated:
    length, own = end - begin, primitive.basis_count
    s = begin + length * np.concatenate([[0.0], nodes(count)])
    accelerations = length**2 * (splines.rows(own, 3, s[1:]) @ primitive.weights.T).T
    theta = accelerations @ (quadrature(count)[:, None] * at_nodes(count))
    if length == 1 and count == own:
        nearest, beyond = primitive.weights, np.zeros(primitive.joint_count)
    else:
        nearest = cho_solve((_factor(count), True), theta.T).T
        beyond = (accelerations - nearest @ at_nodes(count).T) ** 2 @ quadrature(count)
    state, duration = primitive.sample(s[:1]), length * primitive.duration
    start = np.stack([state.positions[0], duration * state.velocities[0]], axis=1)
    weights = nearest
    if count < own:
        space = make_space(count, duration / PLACE_TIME)
        away = primitive.positions(s[1:]).T - start[:, :1] - start[:, 1:] * nodes(count)
        pulled = space.stiffness**4 * (away * quadrature(count)) @ space.rows_at(0, nodes(count))[:, :-2]
        weights = (theta @ space.whitening.T + pulled) @ space.whitening
    velocities = start[:, 1:] + weights @ splines.integration(count, 3).T
    control_points = start[:, :1] + velocities @ splines.integration(count + 1, 4).T
    return Imitated(duration, weights, control_points, start, nearest, beyond)


@lru_cache(maxsize=32)
def _factor(count: int) -> np.ndarray:
    return cholesky(splines.gram(count, splines.ACCELERATION_DEGREE), lower=True)
