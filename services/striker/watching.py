"""Distinguish a flying ball from one that lies or rolls."""

from collections import deque

import numpy as np

SIGHTS, SPAN_S, LARGEST_M = 6, 0.05, 0.04
"""A ball lies if this many sights, over at least this time (s), are within this distance (m); it rolls if it is this
near the floor."""


class Stillness:
    """Detects balls that lie, on a tee or on the floor, or roll on the floor."""

    def __init__(self, floor: float) -> None:
        """`floor`: height (m) of the centre of a ball on the floor."""
        self._highest = floor + LARGEST_M
        self._recent: deque[tuple[float, np.ndarray]] = deque(maxlen=SIGHTS)

    def is_still(self, time: float, position: np.ndarray) -> bool:
        """Process a sight, (3,) m at `time` s; return whether the ball lies or rolls."""
        self._recent.append((time, position))
        if len(self._recent) < SIGHTS or time - self._recent[0][0] < SPAN_S - 1e-6:
            return False
        places = np.array([place for _, place in self._recent])
        return bool(np.all(np.ptp(places, axis=0) < LARGEST_M) or places[:, 2].max() < self._highest)

    def reset(self) -> None:
        """Forget all sights."""
        self._recent.clear()
