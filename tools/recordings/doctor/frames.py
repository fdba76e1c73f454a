"""Faults of frames: samples that repeat the one before, and even stamps that hide repeated or missing ones."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tools.recordings.doctor.finding import Finding, Robot, kept
from tools.recordings.doctor.signals import LEAST_NOISE, counted, grain, ranges, usual_step
from tools.recordings.recording import Recording

SUDDEN, GRAINS = 0.3, 3.0
"""A sample that repeats the one before is stale where the steps before and after it are more than this part of the
usual ones around it, and more than this many times noise or resolution: the arm did not stop."""

AROUND = 11
"""Steps on either side that say what is usual."""

EVEN = 1e-3
"""Stamps are even where none is off by more than this part of a step."""

DOUBLED, STEADY, CLEAR = 1.8, 0.35, 8.0
"""A frame is missing where a step is this many times as long as the four beside it on the average, these are alike to
this part, and they are this many times noise or resolution. Times of capture that were off by a fifth of a step make no
step longer than 1.75 times these."""


@dataclass(frozen=True, slots=True, eq=False)
class _Repeat:
    """Samples `first` + 1 to `last` repeat the sample `first`; the step after them is that of so many samples."""

    first: int
    last: int
    after: float


def repeated(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Samples that repeat the one before in all columns, in the midst of the movement, while the time goes on."""
    repeats = _repeats(recording)
    if repeats and not _time_stood_still(repeats):
        rows = _rows(repeats)
        sentence = f"{counted(len(rows), 'sample')} repeat the one before while the arm moves: left out"
        yield Finding(sentence, True, rows=rows)


def synthetic(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Even stamps, and samples that repeat the one before as if no time had passed."""
    if not _is_even(recording.times):
        return
    repeats = _repeats(recording)
    if repeats and _time_stood_still(repeats):
        rows = _rows(repeats)
        sentence = (
            f"the stamps are even, but {counted(len(rows), 'sample')} repeat the one before and the movement goes on "
            "as if no time had passed: they are left out, with their time"
        )
        yield Finding(sentence, True, rows=rows)


def lost(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Even stamps, and steps that are twice as long as those around them."""
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
    """The recording without repeated frames, and without the time that they took."""
    keep = kept(recording, findings)
    steps = np.diff(recording.times, prepend=recording.times[0])
    times = recording.times[0] + np.cumsum(np.where(keep, steps, 0.0))
    return replace(recording, times=times[keep], values=recording.values[keep])


def _repeats(recording: Recording) -> list[_Repeat]:
    """Runs of samples that are equal in all columns, where the movement around them did not stop."""
    signed = np.diff(recording.values, axis=0)
    steps = np.abs(signed)
    same = np.flatnonzero(~steps.any(axis=1))
    clear = GRAINS * grain(recording) + LEAST_NOISE
    found = []
    for first, last in ranges(same):
        if not first or last + 1 == len(steps) or not np.any(np.minimum(steps[first - 1], steps[last + 1]) > clear):
            continue
        before, after = _moving(steps, first, -1), _moving(steps, last, 1)
        if not len(before) or not len(after):
            continue
        usual = (np.median(before, axis=0) + np.median(after, axis=0)) / 2
        stopped, started = steps[first - 1], steps[last + 1]
        full = (np.minimum(stopped, started) > np.maximum(clear, SUDDEN * usual)) & (usual > 0)
        full &= signed[first - 1] * signed[last + 1] > 0  # where an arm turns round, two samples may well be equal
        if full.any():
            number = int(np.argmax(np.where(full, usual / clear, 0.0)))
            a_sample = usual[number] * _moving_share(steps, first, last)
            found.append(_Repeat(first, last + 1, float(started[number] / a_sample)))
    return found


def _moving(steps: np.ndarray, row: int, direction: int) -> np.ndarray:
    """Up to five steps (k, C) before or after a row that are not zero, nearest first; none near an end."""
    rows = np.arange(row + direction, row + (AROUND + 1) * direction, direction)
    rows = rows[(rows >= 0) & (rows < len(steps))]
    found = steps[rows][steps[rows].any(axis=1)][:5]
    return found if len(found) >= 3 else found[:0]


def _moving_share(steps: np.ndarray, first: int, last: int) -> float:
    """Part of the steps around a run that are not zero: small where every value is held, as by a slower source."""
    around = np.concatenate([steps[max(first - AROUND, 0) : first], steps[last + 1 : last + 1 + AROUND]])
    return float(np.mean(around.any(axis=1)))


def _time_stood_still(repeats: list[_Repeat]) -> bool:
    """Whether the movement goes on after repeats with a usual step, instead of a longer one that catches up."""
    still = np.median([abs(np.log(repeat.after)) for repeat in repeats])
    caught_up = np.median([abs(np.log(repeat.after / (repeat.last - repeat.first + 1))) for repeat in repeats])
    return bool(still < caught_up)


def _rows(repeats: list[_Repeat]) -> np.ndarray:
    return np.concatenate([np.arange(repeat.first + 1, repeat.last + 1) for repeat in repeats])


def _is_even(times: np.ndarray) -> bool:
    even = np.linspace(times[0], times[-1], len(times))
    return bool(np.abs(times - even).max() < EVEN * usual_step(times))


def lost_frames(recording: Recording) -> np.ndarray:
    """Indices of samples before which frames are missing: all columns that move steadily make a longer step."""
    if len(recording.times) < 6:
        return np.zeros(0, int)
    steps = np.abs(np.diff(recording.values, axis=0))
    beside = np.stack([steps[:-4], steps[1:-3], steps[3:-1], steps[4:]])
    most, least = beside.max(axis=0), beside.min(axis=0)
    steady = (least > STEADY * most) & (least > CLEAR * grain(recording) + LEAST_NOISE)
    longer = steps[2:-2] > DOUBLED * beside.mean(axis=0)
    enough = steady.sum(axis=1) >= min(2, steps.shape[1])
    return np.flatnonzero(enough & np.all(longer | ~steady, axis=1)) + 3
