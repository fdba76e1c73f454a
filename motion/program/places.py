"""How much the places of a demonstration count, by how far several recordings of it spread."""

from functools import lru_cache

import numpy as np

from motion.primitive import Primitive

PHASES = 51
"""Even phases at which weights are given."""

RANGE = 1e3
"""Weights lie between 1/RANGE and RANGE, so an arm that was led aside is back within 0.18 to 5.6 place times."""

STEPS = 8
"""A part of a demonstration has the weights of one that begins and ends at eighths, so that few metrics serve all."""


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
