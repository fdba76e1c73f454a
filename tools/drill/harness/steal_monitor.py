"""CPU steal time, during which the host of a virtual machine withholds a core; a long one makes an arm brake."""

import threading
import time
from collections.abc import Callable, Mapping
from typing import Self

from services.common.steal_time import stolen

PERIOD_S = 0.05
WINDOW_S = 1.5 * PERIOD_S
"""Consecutive samples within this time are summed, because one stall may be counted in two."""
BRAKING_STEPS = 2
"""Least steal time that makes an arm brake, in steps of the kernel's count: 20 ms in one piece always count as two
steps, 10 ms never."""


class StealMonitor:
    """Samples the kernel's steal time of each core, twenty times a second while entered."""

    def __init__(
        self, stolen: Callable[[], Mapping[int, int]] = stolen, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._stolen = stolen
        self._clock = clock
        self._last = stolen()
        self._rises: list[tuple[float, int, int]] = []
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="steal monitor", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closed.set()
        self._thread.join()

    def sample(self) -> float:
        """Record the steal time of each core since the last sample; return the monotonic time, s."""
        with self._lock:
            now, seen = self._clock(), self._stolen()
            rises = ((core, steps - self._last.get(core, steps)) for core, steps in seen.items())
            self._rises += [(now, core, steps) for core, steps in rises if steps > 0]
            self._last = seen
            return now

    def peak_steal(self, since: float) -> int:
        """Return the largest steal time of one core within two samples after the time `since`, in steps."""
        self.sample()
        most, recent = 0, []
        for at, core, steps in self._rises:
            if at > since:
                recent = [*(rise for rise in recent if rise[0] > at - WINDOW_S), (at, core, steps)]
                most = max(most, sum(rise[2] for rise in recent if rise[1] == core))
        return most

    def _run(self) -> None:
        while not self._closed.wait(PERIOD_S):
            self.sample()
