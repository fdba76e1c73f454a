"""The part of a demonstration that a motion imitates, and how much its places count."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from motion import splines
from motion.primitive import Primitive
from motion.program.space import PLACE_TIME, make_space

PHASES = 51
"""Even phases at which weights are given."""

RANGE = 1e3
"""Weights lie between 1/RANGE and RANGE, so an arm that was led aside is back within 0.18 to 5.6 place times."""

STEPS = 8
"""A part of a demonstration has the weights of one that begins and ends at eighths, so that few metrics serve all."""


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


@lru_cache(maxsize=64)
def imitated(primitive: Primitive, begin: float, end: float, count: int) -> Imitated:
    """Return what lies between two phases, 0 ≤ begin < end ≤ 1, of a primitive, for `count` functions.

    With u from 0 to 1 in place of s from `begin` to `end`, d″(u) = (end − begin)²·d″(s). It is projected onto the
    functions, except where they are the demonstration's own: in its accelerations, or, on fewer functions, in the
    metric that keeps its positions too.
    """
    length, own = end - begin, primitive.basis_count
    at, step = splines.quadrature(count - 3)
    s = begin + length * np.concatenate([[0.0], at])
    accelerations = length**2 * (splines.rows(own, 3, s[1:]) @ primitive.weights.T).T
    functions = splines.rows(count, 3, at)
    theta = accelerations @ (step[:, None] * functions)
    if length == 1 and count == own:
        nearest, beyond = primitive.weights, np.zeros(primitive.joint_count)
    else:
        plain = make_space(count, 0.0)
        nearest = plain.weights(theta @ plain.whitening.T)
        beyond = (accelerations - nearest @ functions.T) ** 2 @ step
    state, duration = primitive.sample(s[:1]), length * primitive.duration
    start = np.stack([state.positions[0], duration * state.velocities[0]], axis=1)
    weights = nearest
    if count < own:
        space = make_space(count, duration / PLACE_TIME)
        away = primitive.positions(s[1:]).T - start[:, :1] - start[:, 1:] * at
        pulled = space.stiffness**4 * (away * step) @ space.rows_at(0, at)[:, :-2]
        weights = space.weights(theta @ space.whitening.T + pulled)
    velocities = start[:, 1:] + weights @ splines.integration(count, 3).T
    control_points = start[:, :1] + velocities @ splines.integration(count + 1, 4).T
    return Imitated(duration, weights, control_points, start, nearest, beyond)


def place_weights(primitive: Primitive, begin: float, end: float) -> tuple[tuple[float, ...], ...]:
    """Weights at even s of the places of a part between two phases, a tuple for each joint; () without a spread.

    A weight is (σ̄/σ)², with σ the spread there and σ̄ its geometric mean over the joint's whole movement.
    """
    if not primitive.spread.size:
        return ()
    first = min(int(begin * STEPS), STEPS - 1)
    return _weights(primitive, first / STEPS, max(round(end * STEPS), first + 1) / STEPS)


@lru_cache(maxsize=64)
def _weights(primitive: Primitive, begin: float, end: float) -> tuple[tuple[float, ...], ...]:
    logs = np.log(primitive.spread)
    weights = np.clip(np.exp(2 * (logs.mean(axis=1, keepdims=True) - logs)), 1 / RANGE, RANGE)
    at, phases = np.linspace(begin, end, PHASES), np.linspace(0, 1, weights.shape[1])
    return tuple(tuple(np.interp(at, phases, row).tolist()) for row in weights)
