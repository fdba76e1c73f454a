"""The wall clock, as Python reads it, jumps by two hours and back every 50 ms; the monotonic clocks go on."""

import time

HOUR_NS = 3_600_000_000_000
PERIOD_NS = 50_000_000
_time_ns = time.time_ns


def _jumping_ns() -> int:
    ahead = time.monotonic_ns() // PERIOD_NS % 2
    return _time_ns() + (HOUR_NS if ahead else -HOUR_NS)


time.time_ns = _jumping_ns
time.time = lambda: _jumping_ns() * 1e-9
