"""Interpolate joints that were logged at different times, as topics, entities or rows, to common times."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from tools.recordings.recording import Recording, Unreadable

WHOLE = 0.5
"""Complete samples, as a fraction of those of the joint with the fewest, above which incomplete samples are dropped."""

COARSE = 0.05
"""Largest error of every other sample, interpolated from the rest, as a fraction of the largest range of a joint. With
all samples the error is much smaller: halving the step of cubic pieces divides it by eight or more."""

FEW = 0.02
"""Fraction of the samples that may have a larger error, as outliers have."""

GAP = 4.0
"""Longest step of a joint, in units of its median step; longer ones are gaps."""

LEAST = 10
"""Least number of samples of a joint for interpolation."""


def together(recording: Recording) -> Recording:
    """Return a recording with a number for every joint in each sample.

    If most samples have all joints, the rest are dropped. Otherwise every joint is interpolated, by Akima's piecewise
    cubics, to the times of the joint with the fewest samples.

    Raises:
        Unreadable: a joint has too few numbers, or moves too much between them.
    """
    finite = np.isfinite(recording.values) & np.isfinite(recording.times)[:, None]
    whole = finite.all(axis=1)
    if whole.all():
        return recording
    counts = finite.sum(axis=0)
    if np.count_nonzero(whole) >= max(WHOLE * counts.min(), 1):
        note = f"{np.count_nonzero(~whole)} of {len(recording.times)} samples lack a joint and were left out"
        return _at(recording, recording.times[whole], recording.values[whole], note)
    if not recording.stamped:
        return _numbered(recording, finite)
    few = [f"{name} {count}" for name, count in zip(recording.columns, counts, strict=True) if count < LEAST]
    if few:
        raise Unreadable(
            f"{recording.source}: no sample has a number for every joint in {recording.episode}, and too few to "
            f"interpolate, at least {LEAST}, have {', '.join(few)}; record all joints together"
        )
    return _interpolated(recording, finite)


def _numbered(recording: Recording, finite: np.ndarray) -> Recording:
    """Return the k-th numbers of all joints as the k-th sample, for a recording whose times come from a rate."""
    counts = finite.sum(axis=0)
    if np.ptp(counts):
        listed = ", ".join(f"{name} {count}" for name, count in zip(recording.columns, counts, strict=True))
        raise Unreadable(
            f"{recording.source}: its joints were logged one by one, and not equally often, {listed}, so that --rate "
            "cannot say when; record all joints together"
        )
    values = np.column_stack([column[given] for column, given in zip(recording.values.T, finite.T, strict=True)])
    note = "the joints were logged one by one: the first numbers of all are the first sample, and so on"
    return _at(recording, recording.times[: len(values)], values, note)


def _interpolated(recording: Recording, finite: np.ndarray) -> Recording:
    series = []
    for column, given in zip(recording.values.T, finite.T, strict=True):
        times, first = np.unique(recording.times[given], return_index=True)
        series.append((times, column[given][first]))
    largest = max(float(np.ptp(numbers)) for _, numbers in series)
    for name, (times, numbers) in zip(recording.columns, series, strict=True):
        if len(times) < LEAST or _error(times, numbers) > COARSE * largest:
            raise Unreadable(
                f"{recording.source}: its joints were logged at different times, and {name} moves too much between its "
                f"{len(times)} samples to be brought to those of the others; record all joints together, or faster"
            )
    common = min(series, key=lambda one: len(one[0]))[0]
    common = common[(common >= max(t[0] for t, _ in series)) & (common <= min(t[-1] for t, _ in series))]
    known = np.all([_is_near(common, times) for times, _ in series], axis=0)
    common = common[known]
    if not len(common):
        raise Unreadable(f"{recording.source}: its joints have no time in common; record all joints together")
    values = np.column_stack([_at_times(times, numbers, common) for times, numbers in series])
    offset = max(float(np.median(_distance(common, times))) for times, _ in series)
    note = (
        f"the joints were logged up to {1000 * offset:.3g} ms apart, and are interpolated to {len(common)} common times"
    )
    return _at(recording, common, values, note)


def _error(times: np.ndarray, numbers: np.ndarray) -> float:
    """Return the error with which every other sample is interpolated from the rest, without a few outliers."""
    between = slice(1, len(times) - 1 + len(times) % 2, 2)
    missed = np.abs(_at_times(times[::2], numbers[::2], times[between]) - numbers[between])
    missed = np.minimum(missed, np.abs(missed - _turn(numbers)))
    return float(np.nanquantile(missed, 1 - FEW))


def _at_times(times: np.ndarray, numbers: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Interpolate a joint's positions. A wrapped angle remains wrapped."""
    turn = _turn(numbers)
    smooth = Akima1DInterpolator(times, np.unwrap(numbers, period=turn))(wanted)
    after = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    nearest = numbers[np.where(times[after] - wanted < wanted - times[after - 1], after, after - 1)]
    return smooth - turn * np.round((smooth - nearest) / turn)


def _turn(numbers: np.ndarray) -> float:
    """Return a full turn in the unit of angles of this size, rad or degrees."""
    return 360.0 if np.abs(numbers).max() > 4 * np.pi else 2 * np.pi


def _is_near(common: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return whether each common time lies outside the gaps between samples."""
    after = np.clip(np.searchsorted(times, common), 1, len(times) - 1)
    width = times[after] - times[after - 1]
    return (width <= GAP * np.median(np.diff(times))) | (times[after] == common) | (times[after - 1] == common)


def _distance(common: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the distance of each common time from the nearest sample, s."""
    after = np.clip(np.searchsorted(times, common), 1, len(times) - 1)
    return np.minimum(np.abs(times[after] - common), np.abs(times[after - 1] - common))


def _at(recording: Recording, times: np.ndarray, values: np.ndarray, note: str) -> Recording:
    return replace(recording, times=times, values=values, notes=(*recording.notes, note))
