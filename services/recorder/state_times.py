"""The trace tick at a wall time, for messages that carry no time of the robot's clock."""

from bisect import bisect_right
from collections.abc import Sequence


class StateTimes:
    """Receipt times of the states of the last two batches: an event at the end of one may arrive with the next."""

    def __init__(self) -> None:
        self._before: tuple[list[int], list[int]] = ([], [])
        self._walls: list[int] = []
        self._ticks: list[int] = []

    def add_batch(self, walls: Sequence[int], ticks: Sequence[int]) -> None:
        """Take in a batch of states: when each came, Unix ns, and its trace tick."""
        walls_before, ticks_before = self._before
        self._before = list(walls), list(ticks)
        self._walls, self._ticks = [*walls_before, *walls], [*ticks_before, *ticks]

    @property
    def oldest(self) -> int | None:
        """The trace tick of the oldest state that is known, None before any."""
        return self._ticks[0] if self._ticks else None

    def tick_at(self, wall_ns: int) -> int:
        """Return the trace tick that was the newest at `wall_ns`, or the oldest known; 0 before any state."""
        return self._ticks[max(0, bisect_right(self._walls, wall_ns) - 1)] if self._ticks else 0
