"""Convert times in messages to ticks."""

import math

FARTHEST_S = 1e9
"""Largest time, s: 30 years; a trace counts nanoseconds in 64 bits."""

ROUNDING = 1e-6
"""Rounding error of a time, ticks."""


def tick_of(time: float, rate_hz: float) -> int:
    """Return the tick nearest to `time`, s, which is clipped to `FARTHEST_S`."""
    return round(min(max(time, -FARTHEST_S), FARTHEST_S) * rate_hz)


def ticks_ahead(seconds: float, rate_hz: float) -> int:
    """Return a time ahead of now, s, in ticks, rounded up to at least 1."""
    return max(1, math.ceil(seconds * rate_hz - ROUNDING))
