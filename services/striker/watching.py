"""Whether a ball flies, or lies or rolls."""

from collections import deque

import numpy as np

SIGHTS, SPAN_S, LARGEST_M = 6, 0.05, 0.04
"""A ball that was seen so often within this distance, over at least this time, lies; one so near to the floor rolls."""


class Stillness:
    """Tells a ball that lies on its tee, or lies or rolls on the floor, from one that flies."""

    def __init__(self, floor: float) -> None:
        """`floor`: height (m) of the centre of a ball that lies there."""
        self._highest = floor + LARGEST_M
        self._recent: deque[tuple[float, np.ndarray]] = deque(maxlen=SIGHTS)

    def is_still(self, time: float, position: np.ndarray) -> bool:
        """Take in a sight, (3,) m at `time` s, and return whether the ball lies or rolls."""
        self._recent.append((time, position))
        if len(self._recent) < SIGHTS or time - self._recent[0][0] < SPAN_S - 1e-6:
            return False
        places = np.array([place for _, place in self._recent])
        return bool(np.all(np.ptp(places, axis=0) < LARGEST_M) or places[:, 2].max() < self._highest)

    def reset(self) -> None:
        """Forget what was seen."""
        self._recent.clear()
