"""How well the loop keeps its time."""

import numpy as np

from protocol import messages as m

WINDOW = 1000


class CycleStatistics:
    """Counts the ticks of a run and those whose command came too late, and keeps the last 1000 response times."""

    def __init__(self) -> None:
        self.count = 0
        self.refused = 0
        self._first_tick = 0
        self._last_tick = 0
        self._missed = 0
        self._response_us = np.zeros(WINDOW)

    def begin(self, tick: int) -> None:
        """Start counting anew with the state of `tick`, which no command can have answered in time."""
        self._first_tick = self._last_tick = tick
        self._missed = 0
        self.count = 1

    def note_state(self, tick: int, applied_tick: int) -> None:
        """Note the state of `tick`, which tells what was applied up to it.

        Missed are the ticks never seen, and the last one seen where its command was not the one applied to it.
        """
        lost = tick - self._last_tick - 1
        self._missed += lost + (applied_tick < self._last_tick)
        self._last_tick = tick
        self.count += 1

    def note_response(self, nanoseconds: int) -> None:
        """Note how long the answer to the newest state took."""
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
