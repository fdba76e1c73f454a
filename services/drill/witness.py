"""Whether the host of this machine, where it is a virtual one, withheld a core: then an arm is right to brake."""

import threading
import time
from collections.abc import Callable
from typing import Self

from services.host import STEP_S, stolen

PERIOD_S = 0.05
WINDOW_S = 2.5 * PERIOD_S
"""What is withheld in one piece may be counted at two looks."""
LONG_S = 2 * STEP_S
"""With the kernel's steps of 10 ms: more than 10 ms in one piece, the least after which 20 ticks may be missing."""


class Witness:
    """Looks twenty times a second, while entered, at what the kernel says was withheld of each core."""

    def __init__(self, stolen: Callable[[], list[int]] = stolen) -> None:
        self._stolen = stolen
        self._last = stolen()
        self._rises: list[tuple[float, int, int]] = []
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="witness", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closed.set()
        self._thread.join()

    def look(self) -> None:
        """Note by how much the time withheld of each core has risen since the last look."""
        with self._lock:
            now, seen = time.monotonic(), self._stolen()
            rises = [new - old for old, new in zip(self._last, seen, strict=False)]
            self._rises += [(now, core, steps) for core, steps in enumerate(rises) if steps > 0]
            self._last = seen

    def withheld_s(self, since: float) -> float:
        """Return the most that was withheld of one core at once since `since` (monotonic), s."""
        self.look()
        rises = [rise for rise in self._rises if rise[0] >= since]
        most = (
            sum(steps for at, core, steps in rises if core == of and end - WINDOW_S < at <= end) for end, of, _ in rises
        )
        return STEP_S * max(most, default=0)

    def excuses(self, since: float) -> bool:
        """Return whether a core was away for as long as makes an arm brake by itself."""
        return self.withheld_s(since) >= LONG_S

    def _watch(self) -> None:
        while not self._closed.wait(PERIOD_S):
            self.look()
