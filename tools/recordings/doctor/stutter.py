"""Stutter: samples of all joints that were taken earlier or later than their stamps.

A sample that is late by t deviates from the smooth movement by t times the velocity, with the same t for all joints.
Noise does not: the t that the other joints give does not predict a joint's deviation.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.interpolate import BSpline, make_lsq_spline

from motion.demonstration import MIN_SAMPLES
from tools.recordings.doctor.finding import Finding, Robot
from tools.recordings.doctor.frames import lost_frames
from tools.recordings.doctor.signals import counted, interpolation_errors, usual_step
from tools.recordings.recording import Recording

EXPLAINED = 0.35
"""Least fraction of the squared interpolation errors that the other joints predict; for noise it is negative."""

SLIPPED, FEW = 0.25, 0.1
"""Error of time, in steps, that more than this fraction of the samples must exceed; smaller errors are harmless."""

MOVING = 0.1
"""Fraction of the mean squared speed above which a sample is used to estimate times."""

AROUND = 4
"""Number of samples on either side from which velocities are computed."""

KNOT_SAMPLES = 8
"""Samples in a knot interval of the smooth movement's spline."""

SMOOTHER = 0.75
"""Times are moved only if this reduces the distance from the smooth movement at least to this fraction. For strokes too
fast for the spline more than 0.9 remains."""

FARTHEST, LEAST_STEP, ROUNDS = 4.0, 0.05, 20
"""Largest displacement of a sample, least distance from the previous one, both in steps, and number of rounds."""


def stutter(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find samples that are early or late in all joints together."""
    times, values = recording.times, _in_ranges(recording.values)
    if len(times) < MIN_SAMPLES + 2 * AROUND or values.shape[1] < 2:
        return
    steps = (times[2 * AROUND :] - times[: -2 * AROUND]) / usual_step(times)
    velocities = (values[2 * AROUND :] - values[: -2 * AROUND]) / steps[:, None]
    errors = interpolation_errors(times, values)[AROUND:-AROUND]
    squares = velocities**2
    speeds = squares.sum(axis=1)
    used = speeds > MOVING * speeds.mean()
    for row in lost_frames(recording):  # lost frames are another fault
        used[max(row - AROUND - 3, 0) : max(row - AROUND + 4, 0)] = False
    if not used.any():
        return
    errors, velocities, squares, speeds = (array[used] for array in (errors, velocities, squares, speeds))
    products = errors * velocities
    summed = products.sum(axis=1)
    by_others = (summed[:, None] - products) / np.maximum(speeds[:, None] - squares, 0.01 * speeds.mean())
    unexplained = np.sum((errors - by_others * velocities) ** 2)
    slips = np.abs(summed / speeds)
    if np.quantile(slips, 1 - FEW) > SLIPPED and unexplained < (1 - EXPLAINED) * np.sum(errors**2):
        smooth = _smooth_times(recording)
        if _roughness(smooth, values) > SMOOTHER * _roughness(times, values):
            return
        moved = np.abs(smooth - times)
        rows = np.flatnonzero(moved > SLIPPED * usual_step(times))
        sentence = (
            f"{counted(len(rows), 'sample')} came up to {1e3 * moved.max():.2g} ms early or late, in all joints "
            "together: their times are moved to where the movement is smooth"
        )
        yield Finding(sentence, True, rows=rows)


def retime(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """Return the recording with the times at which its samples make a smooth movement."""
    return replace(recording, times=_smooth_times(recording))


def _smooth_times(recording: Recording) -> np.ndarray:
    """Return rising times (n,), s, near the stamps, at which the samples are nearest to a smoothing spline."""
    values, step = _in_ranges(recording.values), usual_step(recording.times)
    stamps = recording.times / step
    behind = LEAST_STEP * np.arange(len(stamps))
    times = stamps
    for _ in range(ROUNDS):
        spline = _smooth(times, values)
        velocities = spline(times, 1)
        speeds = np.sum(velocities**2, axis=1)
        slips = np.sum((values - spline(times)) * velocities, axis=1) / (speeds + 0.01 * speeds.mean())
        slips[[0, -1]] = 0.0
        times = np.clip(times + np.clip(slips, -1, 1), stamps - FARTHEST, stamps + FARTHEST)
        times = np.maximum.accumulate(times - behind) + behind
        times = np.interp(times, times[[0, -1]], stamps[[0, -1]])
    return times * step


def _smooth(times: np.ndarray, values: np.ndarray) -> BSpline:
    """Return the cubic least-squares spline (n,) → (n, C) with an interval for each `KNOT_SAMPLES` samples."""
    count = max(2, len(times) // KNOT_SAMPLES)
    inner = np.interp(np.linspace(0, len(times) - 1, count + 1)[1:-1], np.arange(len(times)), times)
    knots = np.concatenate([times[[0] * 4], inner, times[[-1] * 4]])
    return make_lsq_spline(times, values, knots, k=3)


def _roughness(times: np.ndarray, values: np.ndarray) -> float:
    """Return the root mean square distance of samples at these times, s, from the smooth movement."""
    times = times / usual_step(times)
    return float(np.sqrt(np.mean((values - _smooth(times, values)(times)) ** 2)))


def _in_ranges(values: np.ndarray) -> np.ndarray:
    """Return the columns that move, each divided by its range."""
    spans = np.ptp(values, axis=0)
    return values[:, spans > 0] / spans[spans > 0]
