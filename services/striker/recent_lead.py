"""Lead time of decisions, from recent ones."""

from collections import deque

LONGEST_S = 0.3
REMEMBERED = 8


class RecentLead:
    """The time (s) from a decision to the begin of its motion: the second longest of recent ones, or `initial`."""

    def __init__(self, initial: float) -> None:
        self._recent = deque([initial, initial], maxlen=REMEMBERED)

    def note(self, seconds: float) -> None:
        """Record the time of one decision."""
        self._recent.append(min(max(seconds, 0.0), LONGEST_S))

    def seconds(self) -> float:
        """Return the lead of the next decision."""
        return sorted(self._recent)[-2]
