"""Faults of time: stamps that repeat, go back or jitter, samples that are missing."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from motion.demonstration import MIN_SAMPLES
from robot.recordings.inspection import filled_gaps
from tools.recordings.doctor.finding import Finding, Robot, kept
from tools.recordings.doctor.signals import beside, counted, usual_step
from tools.recordings.recording import Recording

GAP, SHORTEST_GAP = 5.0, 0.02
"""A gap is longer than this many usual steps, and than this many seconds."""

COARSE = 0.5
"""Part of the samples: where more have the stamp of another, stamps were rounded, and no sample is one too many."""

IRREGULAR = 0.02
"""Stamps jitter where half of them are off by more than this part of a step …"""

REVERSED = 0.5
"""Part of the stamps: where more go back, the file begins with the last stamp."""

REVERSED_ORDER = (
    "its stamps fall: the movement begins with the last sample of the file; if the first was recorded first, give "
    "--rate, in samples a second"
)

ROUNDING = 1e-9
"""Rounding, in parts of it, of a sum of steps, which is the same where samples were written backwards."""

SMOOTHER = 0.6
"""… and the movement is smoother by this factor or a smaller one when the stamps are evened out."""


def duplicates(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Samples with the stamp of the one before them."""
    rows = np.flatnonzero(np.diff(recording.times) == 0) + 1
    others = np.count_nonzero(np.any(recording.values[rows] != recording.values[rows - 1], axis=1))
    if others > COARSE * len(recording.times):
        sentence = (
            f"{others} samples have the stamp of the sample before and other positions, so its times are too coarse"
        )
        yield Finding(f"{sentence}; give --rate, in samples a second", fatal=True, rows=rows)
    elif len(rows):
        verb = "has" if len(rows) == 1 else "have"
        sentence = f"{counted(len(rows), 'sample')} {verb} the stamp of the sample before: left out"
        yield Finding(sentence, True, rows=rows)


def backwards(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Stamps that go back: samples in the wrong order, or two recordings in one file."""
    rows = np.flatnonzero(np.diff(recording.times) < 0) + 1
    if not len(rows):
        return
    order = np.argsort(recording.times, kind="stable")
    steps = np.abs(np.diff(recording.values, axis=0)).sum()
    sorted_steps = np.abs(np.diff(recording.values[order], axis=0)).sum()
    if sorted_steps <= steps * (1 + ROUNDING) and len(np.unique(recording.times)) == len(order):
        sentence = f"{counted(len(rows), 'stamp')} went back: the samples are sorted by their stamps"
        yield Finding(sentence, True, rows=rows)
        if len(rows) > REVERSED * len(order):
            yield Finding(REVERSED_ORDER, rows=rows)
        return
    before, after = recording.times[rows[0] - 1], recording.times[rows[0]]
    sentence = (
        f"the time goes back from {before:.6g} s to {after:.6g} s at sample {rows[0]}; "
        "if the file holds several recordings, cut it there, else its stamps are wrong: give --rate"
    )
    yield Finding(sentence, fatal=True, rows=rows)


def too_short(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Too few samples to learn from, or none of them apart."""
    count = len(recording.times)
    if count < MIN_SAMPLES:
        sentence = f"it has {counted(count, 'sample')} to learn from; at least {MIN_SAMPLES} are needed"
        yield Finding(sentence, fatal=True)


def jitter(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Stamps that are late or early, while the samples themselves were taken evenly."""
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
    """Stretches without samples."""
    steps = np.diff(recording.times)
    rows = np.flatnonzero(steps > max(GAP * usual_step(recording.times), SHORTEST_GAP))
    if not len(rows):
        return
    sentence = f"{filled_gaps(recording.times, rows)}; record again if it matters there"
    yield Finding(sentence, rows=np.unique(np.concatenate([rows, rows + 1])), planner_says=True)


def drop_rows(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """The recording without the samples of the findings."""
    keep = kept(recording, findings)
    return replace(recording, times=recording.times[keep], values=recording.values[keep])


def sort_rows(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """The recording with its samples in the order of their stamps."""
    order = np.argsort(recording.times, kind="stable")
    return replace(recording, times=recording.times[order], values=recording.values[order])


def even_out(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """The recording with even steps between its stamps; gaps stay."""
    return replace(recording, times=_evened(recording)[0])


def _evened(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Even stamps (n,), s, and how far the stamps are off them, in steps.

    Each stretch between two gaps has even steps of its own, which its stamps fit best.
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
    """Usual distance of a sample from its neighbours' curve, in units of the columns' ranges."""
    spans = np.ptp(values, axis=0)
    moving = spans > 0
    if not moving.any():
        return 0.0
    return float(np.mean(np.median(np.abs(beside(times, values)[2:-2][:, moving]), axis=0) / spans[moving]))
