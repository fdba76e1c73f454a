"""Ticks of times that other processes state."""

import math

FARTHEST_S = 1e9
"""30 years; a trace counts nanoseconds in 64 bits."""

ROUNDING = 1e-6
"""Rounding error of a time, ticks."""


def tick_of(time: float, rate_hz: float) -> int:
    """Return the tick nearest to `time`, s; a time beyond `FARTHEST_S`, which a message may state, counts as that."""
    return round(min(max(time, -FARTHEST_S), FARTHEST_S) * rate_hz)


def ticks_ahead(seconds: float, rate_hz: float) -> int:
    """Return the ticks of a time ahead of now, s, rounded up: the next tick at least."""
    return max(1, math.ceil(seconds * rate_hz - ROUNDING))
