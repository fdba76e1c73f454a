"""Targets of the balls: a fixed one, or one that moves."""

import numpy as np

Place = tuple[float, float, float]


class Targets:
    """Positions of a target that jumps within `wander`, m, of `middle` along x and y, or stays there if that is 0."""

    def __init__(self, middle: Place, wander: float, seed: int) -> None:
        self._middle = middle
        self._wander = wander
        self._random = np.random.default_rng([seed, 1])

    @property
    def move(self) -> bool:
        """Whether the target moves."""
        return self._wander > 0

    def next(self) -> Place:
        """Return the next position, m."""
        x, y, z = self._middle
        if not self.move:
            return self._middle
        offset = self._wander * self._random.uniform(-1, 1, 2)
        return x + float(offset[0]), y + float(offset[1]), z
