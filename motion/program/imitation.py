"""The part of a demonstration that a motion imitates, and the weights of its positions."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from motion import splines
from motion.primitive import Primitive
from motion.program.space import PLACE_TIME, make_space

PHASES = 51
"""Number of evenly spaced phases at which weights are given."""

RANGE = 1e3
"""Weights lie between 1/RANGE and RANGE, so a deviating arm returns within 0.18 to 5.6 place times."""

STEPS = 8
"""A part of a demonstration gets the weights of the part between the nearest eighths, so that few metrics suffice."""


@dataclass(frozen=True, slots=True, eq=False)
class Imitated:
    """A part d of a demonstration in its own normalised time u from 0 to 1.

    duration: of the part in the demonstration, s. weights (J, N): of d″(u). control_points (J, N + 2): of d(u), rad.
    start (J, 2): d and d′ at u = 0, rad. nearest (J, N): weights of the projection of d″; they differ from `weights`
    only if the functions are too few to keep the positions too. beyond (J,): ∫(d″ − Σwψ)² du of the projection, the
    part of the error that no weights can avoid.
    """

    duration: float
    weights: np.ndarray
    control_points: np.ndarray
    start: np.ndarray
    nearest: np.ndarray
    beyond: np.ndarray

    def missed(self, weights: np.ndarray | float) -> np.ndarray:
        """∫(g″ − d″)² du (J,) of motions with weights (J, N); the projection's error is orthogonal to all functions."""
        apart = weights - self.nearest
        return ((apart @ splines.gram(apart.shape[1], splines.ACCELERATION_DEGREE)) * apart).sum(axis=1) + self.beyond


@lru_cache(maxsize=64)
def imitated(primitive: Primitive, begin: float, end: float, count: int) -> Imitated:
    """Return the part of a primitive between two phases, 0 ≤ begin < end ≤ 1, on `count` functions.

    With u from 0 to 1 in place of s from `begin` to `end`, d″(u) = (end − begin)²·d″(s). Unless the functions are the
    demonstration's own, d″ is projected onto them; on fewer functions, in the metric that keeps positions too.
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
    """Weights of the positions of a part between two phases, at evenly spaced s, a tuple for each joint.

    Empty without a spread. A weight is (σ̄/σ)², with σ the spread there and σ̄ its geometric mean over the joint's
    complete movement.
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
