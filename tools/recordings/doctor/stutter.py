"""Stutter: samples that were taken earlier or later than their stamps say, in all joints together.

Seen from the smooth movement, each joint is then off along its own velocity by one and the same time. Noise is not:
what the other joints say about that time predicts nothing of a joint's own distance from the curve.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.interpolate import BSpline, make_lsq_spline

from motion.demonstration import MIN_SAMPLES
from tools.recordings.doctor.finding import Finding, Robot
from tools.recordings.doctor.frames import lost_frames
from tools.recordings.doctor.signals import beside, counted, usual_step
from tools.recordings.recording import Recording

EXPLAINED = 0.35
"""Part of the samples' distances from their neighbours' curve that the other joints predict; of noise they predict less
than nothing."""

SLIPPED, FEW = 0.25, 0.1
"""So many samples are off by more than this part of a step; less changes nothing that matters."""

MOVING = 0.1
"""Part of the mean squared speed above which a sample says something about time."""

AROUND = 4
"""Samples on either side that say how fast the arm moves."""

KNOT_SAMPLES = 8
"""Samples in an interval of the smooth movement's spline."""

SMOOTHER = 0.75
"""Times are moved only where the samples are then nearer to the smooth movement by this factor or a smaller one. Of
strokes that are too fast for its spline, more than 0.9 remains."""

FARTHEST, LEAST_STEP, ROUNDS = 4.0, 0.05, 20
"""A sample is moved by at most so many steps, and stays this part of a step behind the one before."""


def stutter(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Samples that come early or late in all joints together."""
    times, values = recording.times, _in_ranges(recording.values)
    if len(times) < MIN_SAMPLES + 2 * AROUND or values.shape[1] < 2:
        return
    apart = (times[2 * AROUND :] - times[: -2 * AROUND]) / usual_step(times)
    velocities = (values[2 * AROUND :] - values[: -2 * AROUND]) / apart[:, None]
    distances = beside(times, values)[AROUND:-AROUND]
    squares = velocities**2
    speeds = squares.sum(axis=1)
    said = speeds > MOVING * speeds.mean()
    for row in lost_frames(recording):  # these are another fault
        said[max(row - AROUND - 3, 0) : max(row - AROUND + 4, 0)] = False
    if not said.any():
        return
    distances, velocities, squares, speeds = (array[said] for array in (distances, velocities, squares, speeds))
    along = distances * velocities
    summed = along.sum(axis=1)
    others = (summed[:, None] - along) / np.maximum(speeds[:, None] - squares, 0.01 * speeds.mean())
    left = np.sum((distances - others * velocities) ** 2)
    slips = np.abs(summed / speeds)
    if np.quantile(slips, 1 - FEW) > SLIPPED and left < (1 - EXPLAINED) * np.sum(distances**2):
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
    """The recording with its samples at the times at which the movement is smooth."""
    return replace(recording, times=_smooth_times(recording))


def _smooth_times(recording: Recording) -> np.ndarray:
    """Rising times (n,), s, near the stamps, at which the samples are nearest to a spline through all of them."""
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
    """The cubic spline (n,) → (n, C) that is nearest to the samples, with an interval for every few of them."""
    count = max(2, len(times) // KNOT_SAMPLES)
    inner = np.interp(np.linspace(0, len(times) - 1, count + 1)[1:-1], np.arange(len(times)), times)
    knots = np.concatenate([times[[0] * 4], inner, times[[-1] * 4]])
    return make_lsq_spline(times, values, knots, k=3)


def _roughness(times: np.ndarray, values: np.ndarray) -> float:
    """Root mean square distance of samples at these times, s, from the smooth movement."""
    times = times / usual_step(times)
    return float(np.sqrt(np.mean((values - _smooth(times, values)(times)) ** 2)))


def _in_ranges(values: np.ndarray) -> np.ndarray:
    """The columns that move, each in units of its range."""
    spans = np.ptp(values, axis=0)
    return values[:, spans > 0] / spans[spans > 0]
