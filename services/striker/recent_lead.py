"""How long decisions take until their motions begin."""

from collections import deque

LONGEST_S = 0.3
REMEMBERED = 8


class RecentLead:
    """The time (s) from a decision to the begin of its motion: the second longest of the last few; first `initial`."""

    def __init__(self, initial: float) -> None:
        self._recent = deque([initial, initial], maxlen=REMEMBERED)

    def note(self, seconds: float) -> None:
        """Take in how long one took."""
        self._recent.append(min(max(seconds, 0.0), LONGEST_S))

    def seconds(self) -> float:
        """Return how long the next one may take."""
        return sorted(self._recent)[-2]
