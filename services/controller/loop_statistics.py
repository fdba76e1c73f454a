"""Timing statistics of the loop."""

import numpy as np

from protocol import messages as m

WINDOW = 1000


class LoopStatistics:
    """Counts the ticks and missed ticks of a run, and keeps the last 1000 response times.

    Attributes:
        count: States answered in this run.
        refused: Old, duplicate or malformed states, in all runs.
    """

    def __init__(self) -> None:
        self.count = 0
        self.refused = 0
        self._first_tick = 0
        self._last_tick = 0
        self._missed = 0
        self._response_us = np.zeros(WINDOW)

    def begin(self, tick: int) -> None:
        """Start a run with the state of `tick`, to which no command can have been applied yet."""
        self._first_tick = self._last_tick = tick
        self._missed = 0
        self.count = 1

    def note_state(self, tick: int, applied_tick: int) -> None:
        """Count the state of `tick`; `applied_tick` is the tick whose command the arm applied last.

        A tick is missed if its state never arrived, or if its command was not applied in time.
        """
        lost = tick - self._last_tick - 1
        self._missed += lost + (applied_tick < self._last_tick)
        self._last_tick = tick
        self.count += 1

    def note_response(self, nanoseconds: int) -> None:
        """Add the response time of the newest state."""
        self._response_us[(self.count - 1) % WINDOW] = nanoseconds * 1e-3

    def message(self) -> m.Cycle:
        """Return the statistics as published."""
        elapsed = self._last_tick - self._first_tick
        times = np.sort(self._response_us[: min(self.count, WINDOW)]).tolist() or [0.0]
        return m.Cycle(
            count=self.count,
            missed=self._missed,
            on_time_ratio=1.0 - self._missed / elapsed if elapsed else 1.0,
            late_us=m.Lateness(p50=times[len(times) // 2], p99=times[len(times) * 99 // 100], max=times[-1]),
            refused=self.refused,
        )
