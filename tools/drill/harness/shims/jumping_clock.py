"""The wall clock, as Python reads it, jumps by two hours and back every 50 ms; the monotonic clocks go on.

When the process ends it writes how often it saw a jump to PID.jumps, beside the `sitecustomize.py` that imported this
module.
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
    """The clock; counts the readings that are on the other side of a jump than the one before."""

    def __init__(self) -> None:
        self._ahead = 0
        self.jumps = 0

    def time_ns(self) -> int:
        """Return the time in Unix ns, an hour late or early."""
        ahead = time.monotonic_ns() // PERIOD_NS % 2
        self.jumps += ahead != self._ahead
        self._ahead = ahead
        return _time_ns() + (HOUR_NS if ahead else -HOUR_NS)


def leave_mark(clock: JumpingClock, directory: Path) -> None:
    """Write how often the clock was seen to jump."""
    (directory / f"{os.getpid()}.jumps").write_text(str(clock.jumps))


_clock = JumpingClock()
time.time_ns = _clock.time_ns
time.time = lambda: _clock.time_ns() * 1e-9
atexit.register(leave_mark, _clock, Path(str(sys.modules["sitecustomize"].__file__)).parent)
