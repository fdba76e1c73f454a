"""Trace ticks of wall times, for messages without a time of the robot's clock."""

from bisect import bisect_right
from collections.abc import Sequence


class StateTimes:
    """Arrival times of the states of the last two batches: an event at the end of one may arrive with the next."""

    def __init__(self) -> None:
        self._before: tuple[list[int], list[int]] = ([], [])
        self._walls: list[int] = []
        self._ticks: list[int] = []

    def add_batch(self, walls: Sequence[int], ticks: Sequence[int]) -> None:
        """Add a batch of states: the arrival of each, Unix ns, and its trace tick."""
        walls_before, ticks_before = self._before
        self._before = list(walls), list(ticks)
        self._walls, self._ticks = [*walls_before, *walls], [*ticks_before, *ticks]

    @property
    def oldest(self) -> int | None:
        """The trace tick of the oldest known state, None before the first."""
        return self._ticks[0] if self._ticks else None

    def tick_at(self, wall_ns: int) -> int:
        """Return the newest trace tick at `wall_ns`, or the oldest known one; 0 before the first state."""
        return self._ticks[max(0, bisect_right(self._walls, wall_ns) - 1)] if self._ticks else 0
