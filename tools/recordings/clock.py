"""Find the column of sample times, and its unit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tools.recordings.names import words

UNITS = {
    "s": 1.0, "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0,
    "min": 60.0, "mins": 60.0, "minute": 60.0, "minutes": 60.0, "h": 3600.0, "hour": 3600.0, "hours": 3600.0,
    "ms": 1e-3, "msec": 1e-3, "millis": 1e-3, "milliseconds": 1e-3,
    "us": 1e-6, "µs": 1e-6, "usec": 1e-6, "usecs": 1e-6, "micros": 1e-6, "microseconds": 1e-6,
    "ns": 1e-9, "nsec": 1e-9, "nsecs": 1e-9, "nanosec": 1e-9, "nanos": 1e-9, "nanoseconds": 1e-9,
}  # fmt: skip
SPOKEN = {1.0: "s", 1e-3: "ms", 1e-6: "µs", 1e-9: "ns"}

TIMES = (
    "time", "timestamp", "timestamps", "times", "stamp", "ts", "datetime", "t", "elapsed", "clock", "when",
    "zeit", "zeitstempel", "tv",
)  # fmt: skip
"""Words that name a column of times, the likeliest first."""

LONGEST_STEP = 0.5
"""Largest plausible step between samples, s; a larger one means a smaller unit."""

LONGEST_SMALL_STEP = 0.25
"""The same for smaller units, s: whole numbers 500 apart are µs at 2 kHz rather than ms at 2 Hz."""


MOST_UNEVEN = 4.0
"""Largest ratio of the 90th to the 10th percentile of the steps of an unnamed column that is taken as the time: a joint
that starts and ends at rest has steps near zero at both ends …"""

NEARLY_STRAIGHT = 0.05
"""… or its largest distance from a straight line over the samples, as a part of its range: stamps of bursts are uneven,
but a joint that starts and ends at rest is farther from the line."""


@dataclass(frozen=True, slots=True)
class Clock:
    """Columns whose sum is the time, the unit of each in s, and sentences about assumptions."""

    columns: tuple[int, ...]
    units: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()


def clock_of(names: Sequence[str], values: np.ndarray) -> Clock:
    """Return the clock of a table: by name, or without names the first column if it rises like a time."""
    if not names:
        if values.shape[1] < 2 or not _rises_like_time(values[:, 0]):
            return Clock(())
        return _first_column(values[:, 0])
    ranked = [(rank, index) for index, name in enumerate(names) if (rank := _rank(name)) is not None]
    if not ranked:
        return Clock(())
    column = min(ranked)[1]
    said = [UNITS[word] for word in words(names[column]) if word in UNITS]
    if not said:
        return _guessed(column, names[column], values[:, column])
    fraction = _fraction(names, column) if said[-1] == 1.0 else None
    return Clock((column,), (said[-1],)) if fraction is None else Clock((column, fraction[0]), (1.0, fraction[1]))


def seconds(values: np.ndarray, clock: Clock) -> np.ndarray:
    """Return times (n,), s, since the first sample; whole numbers are subtracted before they are scaled."""
    total = np.zeros(len(values))
    for column, unit in zip(clock.columns, clock.units, strict=True):
        total += (values[:, column] - values[0, column]) * unit
    return total


def unit_of_steps(times: np.ndarray) -> float:
    """Return the largest unit, s, with a plausible median step between times."""
    steps = np.diff(np.unique(times[np.isfinite(times)]))
    step = float(np.median(steps)) if len(steps) else 0.0
    longest = {unit: LONGEST_STEP if unit == 1.0 else LONGEST_SMALL_STEP for unit in SPOKEN}
    return next((unit for unit in SPOKEN if step * unit <= longest[unit]), 1e-9)


def _rises_like_time(column: np.ndarray) -> bool:
    """Whether a column rises like times: no step is negative, and most have one size or the column is nearly a line."""
    known = column[np.isfinite(column)]
    steps = np.diff(known)
    if not np.any(steps > 0) or np.any(steps < 0):
        return False
    low, high = np.percentile(steps, (10, 90))
    line = np.linspace(known[0], known[-1], len(known))
    return bool(high <= MOST_UNEVEN * low or np.abs(known - line).max() <= NEARLY_STRAIGHT * (known[-1] - known[0]))


def _rank(name: str) -> tuple[int, int] | None:
    """Return the rank of a column as the time, smaller is likelier: other words, then the order in TIMES; or None."""
    said = words(name)
    kept = [word for word in said if word not in UNITS]
    if not kept:
        return (1, len(TIMES)) if said else None
    found = [TIMES.index(word) for word in kept if word in TIMES]
    return (len(kept), min(found)) if found else None


def _guessed(column: int, name: str, times: np.ndarray) -> Clock:
    unit = unit_of_steps(times)
    note = () if unit == 1.0 else (f"{name} is taken as {SPOKEN[unit]}, for in s its samples would lie too far apart",)
    return Clock((column,), (unit,), note)


def _first_column(times: np.ndarray) -> Clock:
    """Return the clock of a first column without a name, and a note: a joint of constant speed rises like a time."""
    known, unit = times[np.isfinite(times)], unit_of_steps(times)
    note = (
        f"the first column has no name and rises evenly from {known[0]:.6g} to {known[-1]:.6g}, so it is taken as the "
        f"time in {SPOKEN[unit]}; if it is a joint, give --rate"
    )
    return Clock((0,), (unit,), (note,))


def _fraction(names: Sequence[str], column: int) -> tuple[int, float] | None:
    """Return the column of nano- or microseconds that complements one of seconds, and its unit, as in ROS stamps."""
    stem = words(names[column])[:-1]
    for index, name in enumerate(names):
        parts = words(name)
        unit = UNITS.get(parts[-1]) if index != column and parts[:-1] == stem and parts else None
        if unit in (1e-6, 1e-9):
            return index, unit
    return None
