"""Ticks of times that other processes state."""

FARTHEST_S = 1e9
"""30 years; a trace counts nanoseconds in 64 bits."""


def tick_of(time: float, rate_hz: float) -> int:
    """Return the tick nearest to `time`, s; a time beyond `FARTHEST_S`, which a message may state, counts as that."""
    return round(min(max(time, -FARTHEST_S), FARTHEST_S) * rate_hz)
