"""Whether a ball flies or lies."""

from collections import deque

import numpy as np

SIGHTS, SPAN_S, LARGEST_M = 6, 0.05, 0.04
"""A ball that was seen so often within this distance, over at least this time, lies."""


class Stillness:
    """Tells a ball that lies on its tee or on the floor from one that flies."""

    def __init__(self) -> None:
        self._recent: deque[tuple[float, np.ndarray]] = deque(maxlen=SIGHTS)

    def is_still(self, time: float, position: np.ndarray) -> bool:
        """Take in a sight, (3,) m at `time` s, and return whether the ball lies."""
        self._recent.append((time, position))
        if len(self._recent) < SIGHTS or time - self._recent[0][0] < SPAN_S - 1e-6:
            return False
        places = np.array([place for _, place in self._recent])
        return bool(np.all(np.ptp(places, axis=0) < LARGEST_M))

    def reset(self) -> None:
        """Forget what was seen."""
        self._recent.clear()
