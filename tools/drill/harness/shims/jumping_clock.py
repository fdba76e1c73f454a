"""A wall clock that jumps by two hours and back every 50 ms, as Python reads it; monotonic clocks are unchanged.

At its exit the process writes the number of jumps that it read to PID.jumps, in the directory of the `sitecustomize.py`
that imported this module.
"""

import atexit
import os
import sys
import time
from pathlib import Path

HOUR_NS = 3_600_000_000_000
PERIOD_NS = 50_000_000
_time_ns = time.time_ns


class JumpingClock:
    """The clock; it counts the jumps between consecutive readings."""

    def __init__(self) -> None:
        self._ahead = 0
        self.jumps = 0

    def time_ns(self) -> int:
        """Return the Unix time, ns, an hour ahead or behind."""
        ahead = time.monotonic_ns() // PERIOD_NS % 2
        self.jumps += ahead != self._ahead
        self._ahead = ahead
        return _time_ns() + (HOUR_NS if ahead else -HOUR_NS)


def write_jumps(clock: JumpingClock, directory: Path) -> None:
    """Write the number of jumps that were read."""
    (directory / f"{os.getpid()}.jumps").write_text(str(clock.jumps))


_clock = JumpingClock()
time.time_ns = _clock.time_ns
time.time = lambda: _clock.time_ns() * 1e-9
atexit.register(write_jumps, _clock, Path(str(sys.modules["sitecustomize"].__file__)).parent)
