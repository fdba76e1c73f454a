"""Faults of frames: samples that repeat the previous one, and repeated or lost frames under even stamps."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tools.recordings.doctor.finding import Finding, Robot, kept_samples
from tools.recordings.doctor.signals import LEAST_NOISE, adjacent_runs, counted, noise_floor, usual_step
from tools.recordings.recording import Recording

SUDDEN, NOISE_FLOORS = 0.3, 3.0
"""A sample that repeats the previous one is stale if the steps before and after it exceed this fraction of the usual
steps around it and this multiple of the noise floor: the arm did not stop."""

AROUND = 11
"""Number of steps on either side that define the usual step."""

EVEN = 1e-3
"""Stamps are even if each deviates from an even one by at most this fraction of a step."""

DOUBLED, STEADY, CLEAR = 1.8, 0.35, 8.0
"""A frame is missing where a step is this multiple of the mean of its four neighbours, the ratio of the smallest to the
largest of these exceeds this, and they exceed this multiple of the noise floor. Times of capture that are wrong by a
fifth of a step lengthen a step to at most 1.75 times its neighbours."""


@dataclass(frozen=True, slots=True, eq=False)
class _Repeat:
    """Samples `first` + 1 to `last` repeat the sample `first`; the next step is as long as `after` samples."""

    first: int
    last: int
    after: float


def repeated(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find samples that repeat the previous one in all columns during the movement, while time continues."""
    repeats = _repeats(recording)
    if repeats and not _time_stood_still(repeats):
        rows = _rows(repeats)
        sentence = f"{counted(len(rows), 'sample')} repeat the one before while the arm moves: left out"
        yield Finding(sentence, True, rows=rows)


def synthetic(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find samples under even stamps that repeat the previous one although no time passed."""
    if not _is_even(recording.times):
        return
    repeats = _repeats(recording)
    if repeats and _time_stood_still(repeats):
        rows = _rows(repeats)
        sentence = (
            f"the stamps are even, but {counted(len(rows), 'sample')} repeat the one before, after which the movement "
            "continues as if no time had passed: they are left out, with their time"
        )
        yield Finding(sentence, True, rows=rows)


def lost(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find steps under even stamps that are twice as long as their neighbours."""
    if not _is_even(recording.times):
        return
    rows = lost_frames(recording)
    if len(rows):
        sentence = (
            f"the stamps are even, but at {counted(len(rows), 'place')} the arm moves twice as far or more from one "
            "sample to the next: frames were lost before they were stamped; record with the times of capture"
        )
        yield Finding(sentence, rows=rows)


def drop_with_time(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """Return the recording without repeated frames and without their time."""
    keep = kept_samples(recording, findings)
    steps = np.diff(recording.times, prepend=recording.times[0])
    times = recording.times[0] + np.cumsum(np.where(keep, steps, 0.0))
    return replace(recording, times=times[keep], values=recording.values[keep])


def _repeats(recording: Recording) -> list[_Repeat]:
    """Return the runs of samples that are equal in all columns although the arm did not stop."""
    signed = np.diff(recording.values, axis=0)
    steps = np.abs(signed)
    same = np.flatnonzero(~steps.any(axis=1))
    clear = NOISE_FLOORS * noise_floor(recording) + LEAST_NOISE
    found = []
    for first, last in adjacent_runs(same):
        if not first or last + 1 == len(steps) or not np.any(np.minimum(steps[first - 1], steps[last + 1]) > clear):
            continue
        before, after = _moving(steps, first, -1), _moving(steps, last, 1)
        if not len(before) or not len(after):
            continue
        usual = (np.median(before, axis=0) + np.median(after, axis=0)) / 2
        stopped, started = steps[first - 1], steps[last + 1]
        full = (np.minimum(stopped, started) > np.maximum(clear, SUDDEN * usual)) & (usual > 0)
        full &= signed[first - 1] * signed[last + 1] > 0  # where a joint reverses, two samples may be equal
        if full.any():
            number = int(np.argmax(np.where(full, usual / clear, 0.0)))
            per_sample = usual[number] * _moving_fraction(steps, first, last)
            found.append(_Repeat(first, last + 1, float(started[number] / per_sample)))
    return found


def _moving(steps: np.ndarray, row: int, direction: int) -> np.ndarray:
    """Return up to five nonzero steps (k, C) before or after a row, nearest first; none near an end."""
    rows = np.arange(row + direction, row + (AROUND + 1) * direction, direction)
    rows = rows[(rows >= 0) & (rows < len(steps))]
    found = steps[rows][steps[rows].any(axis=1)][:5]
    return found if len(found) >= 3 else found[:0]


def _moving_fraction(steps: np.ndarray, first: int, last: int) -> float:
    """Return the fraction of nonzero steps around a run, which is small if a slower source repeats every value."""
    around = np.concatenate([steps[max(first - AROUND, 0) : first], steps[last + 1 : last + 1 + AROUND]])
    return float(np.mean(around.any(axis=1)))


def _time_stood_still(repeats: list[_Repeat]) -> bool:
    """Return whether the step after repeats is usual, rather than so long that it makes up for their time."""
    still = np.median([abs(np.log(repeat.after)) for repeat in repeats])
    caught_up = np.median([abs(np.log(repeat.after / (repeat.last - repeat.first + 1))) for repeat in repeats])
    return bool(still < caught_up)


def _rows(repeats: list[_Repeat]) -> np.ndarray:
    return np.concatenate([np.arange(repeat.first + 1, repeat.last + 1) for repeat in repeats])


def _is_even(times: np.ndarray) -> bool:
    even = np.linspace(times[0], times[-1], len(times))
    return bool(np.abs(times - even).max() < EVEN * usual_step(times))


def lost_frames(recording: Recording) -> np.ndarray:
    """Return the indices of samples before which frames are missing: all steadily moving columns have a long step."""
    if len(recording.times) < 6:
        return np.zeros(0, int)
    steps = np.abs(np.diff(recording.values, axis=0))
    neighbours = np.stack([steps[:-4], steps[1:-3], steps[3:-1], steps[4:]])
    most, least = neighbours.max(axis=0), neighbours.min(axis=0)
    steady = (least > STEADY * most) & (least > CLEAR * noise_floor(recording) + LEAST_NOISE)
    longer = steps[2:-2] > DOUBLED * neighbours.mean(axis=0)
    enough = steady.sum(axis=1) >= min(2, steps.shape[1])
    return np.flatnonzero(enough & np.all(longer | ~steady, axis=1)) + 3
