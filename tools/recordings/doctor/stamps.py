"""Faults of time: stamps that repeat, decrease or jitter, and missing samples."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from motion.demonstration import MIN_SAMPLES
from robot.recordings.inspection import filled_gaps
from tools.recordings.doctor.finding import Finding, Robot, kept_samples
from tools.recordings.doctor.signals import counted, interpolation_errors, usual_step
from tools.recordings.recording import Recording

GAP, SHORTEST_GAP = 5.0, 0.02
"""A gap is longer than this number of usual steps and than this, s."""

COARSE = 0.5
"""Fraction of samples with a stamp of another sample above which the stamps were rounded, so that no sample is a
duplicate."""

IRREGULAR = 0.02
"""Stamps jitter if half of them deviate from even ones by more than this fraction of a step …"""

SMOOTHER = 0.6
"""… and even stamps reduce the roughness of the movement at least to this fraction."""

ROUNDING = 1e-9
"""Relative rounding error of a sum of steps, which does not change if samples are written in reverse order."""


def duplicates(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find samples with the stamp of the previous sample."""
    rows = np.flatnonzero(np.diff(recording.times) == 0) + 1
    others = np.count_nonzero(np.any(recording.values[rows] != recording.values[rows - 1], axis=1))
    if others > COARSE * len(recording.times):
        sentence = (
            f"{others} samples have the stamp of the sample before and other positions, so the times are too coarse"
        )
        yield Finding(f"{sentence}; give --rate, in samples a second", fatal=True, rows=rows)
    elif len(rows):
        verb = "has" if len(rows) == 1 else "have"
        sentence = f"{counted(len(rows), 'sample')} {verb} the stamp of the sample before: left out"
        yield Finding(sentence, True, rows=rows)


def backwards(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find decreasing stamps: samples in the wrong order, or two recordings in one file."""
    rows = np.flatnonzero(np.diff(recording.times) < 0) + 1
    if not len(rows):
        return
    order = np.argsort(recording.times, kind="stable")
    steps = np.abs(np.diff(recording.values, axis=0)).sum()
    sorted_steps = np.abs(np.diff(recording.values[order], axis=0)).sum()
    if sorted_steps <= steps * (1 + ROUNDING) and len(np.unique(recording.times)) == len(order):
        sentence = f"{counted(len(rows), 'stamp')} went back: the samples are sorted by their stamps"
        yield Finding(sentence, True, rows=rows)
        return
    before, after = recording.times[rows[0] - 1], recording.times[rows[0]]
    sentence = (
        f"the time goes back from {before:.6g} s to {after:.6g} s at sample {rows[0]}; "
        "if the file holds several recordings, cut it there, else its stamps are wrong: give --rate"
    )
    yield Finding(sentence, fatal=True, rows=rows)


def too_short(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find recordings with too few samples to learn from."""
    count = len(recording.times)
    if count < MIN_SAMPLES:
        sentence = f"{counted(count, 'sample')} left; at least {MIN_SAMPLES} are needed"
        yield Finding(sentence, fatal=True)


def jitter(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find jittering stamps of samples that were taken evenly."""
    even, off = _evened(recording)
    if np.median(np.abs(off)) < IRREGULAR or np.any(np.diff(even) <= 0):
        return
    stamped, evened = (_roughness(times, recording.values) for times in (recording.times, even))
    if evened < SMOOTHER * stamped:
        late = 1e3 * usual_step(recording.times) * float(np.abs(off).max())
        sentence = (
            f"stamps jitter by up to {late:.2g} ms, while the movement is smooth at even steps: they are evened out"
        )
        yield Finding(sentence, True, rows=np.flatnonzero(np.abs(off) > IRREGULAR))


def gaps(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find gaps in the samples."""
    steps = np.diff(recording.times)
    rows = np.flatnonzero(steps > max(GAP * usual_step(recording.times), SHORTEST_GAP))
    if not len(rows):
        return
    sentence = f"{filled_gaps(recording.times, rows)}; record again if it matters there"
    yield Finding(sentence, rows=np.unique(np.concatenate([rows, rows + 1])), planner_warns=True)


def drop_rows(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """Return the recording without the samples of the findings."""
    keep = kept_samples(recording, findings)
    return replace(recording, times=recording.times[keep], values=recording.values[keep])


def sort_rows(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """Return the recording with its samples in the order of their stamps."""
    order = np.argsort(recording.times, kind="stable")
    return replace(recording, times=recording.times[order], values=recording.values[order])


def even_out(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """Return the recording with even stamps between its gaps."""
    return replace(recording, times=_evened(recording)[0])


def _evened(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Return even stamps (n,), s, and the deviations of the stamps from these, in steps.

    The even stamps between two gaps are a linear fit to the stamps there.
    """
    times = recording.times
    even, off = times.copy(), np.zeros(len(times))
    step = usual_step(times)
    cuts = np.flatnonzero(np.diff(times) > 1.9 * step) + 1
    for piece in np.split(np.arange(len(times)), cuts):
        if len(piece) > 2:
            line = np.polynomial.Polynomial.fit(piece, times[piece], 1)
            even[piece] = line(piece)
            off[piece] = (times[piece] - even[piece]) / step
    return even, off


def _roughness(times: np.ndarray, values: np.ndarray) -> float:
    """Return the median interpolation error of the samples, as a fraction of the columns' ranges."""
    spans = np.ptp(values, axis=0)
    moving = spans > 0
    if not moving.any():
        return 0.0
    return float(
        np.mean(np.median(np.abs(interpolation_errors(times, values)[2:-2][:, moving]), axis=0) / spans[moving])
    )
