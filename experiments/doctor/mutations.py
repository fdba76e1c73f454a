"""Faults to put into clean recordings."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from experiments.doctor.clean import Base, Clean
from tools.recordings.recording import Recording

COLUMNS = "columns"

Put = Callable[[np.random.Generator, Clean], tuple[Recording, str | None]]
"""Returns the recording with the fault, and the column that has it, None for all of them."""


@dataclass(frozen=True, slots=True)
class Mutation:
    """A fault to put into recordings.

    Attributes:
        code: Its code in the doctor's table; COLUMNS is found when columns are matched to joints.
        words: Its description.
        put: Puts it into a recording.
        base: Kind of recordings that get it.
        repaired: Whether it must be repaired.
    """

    code: str
    words: str
    put: Put
    base: Base = "any"
    repaired: bool = False


def _idle(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    step, moving = _step(recording), np.ptp(recording.times)
    before, after = (int(moving * rng.uniform(0.2, 2.0) / step) for _ in range(2))
    which = rng.integers(3)
    before, after = before * (which != 1), after * (which != 2)
    rows = np.concatenate([np.zeros(before, int), np.arange(len(recording.times)), np.full(after, -1)])
    values = recording.values[rows]
    flicker = np.ones(len(rows), bool)
    flicker[before : before + len(recording.times)] = False
    values[flicker] += clean.noise * rng.standard_normal((int(flicker.sum()), values.shape[1]))
    if clean.resolution:
        values = np.round(values / clean.resolution) * clean.resolution
    start = recording.times[0] - step * np.arange(before, 0, -1)
    end = recording.times[-1] + step * np.arange(1, after + 1)
    return replace(recording, times=np.concatenate([start, recording.times, end]), values=values), None


def _same_stamp(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    rows = np.sort(np.concatenate([np.arange(len(recording.times)), _some(rng, recording)]))
    return _rows(recording, rows), None


def _repeated(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    values = recording.values.copy()
    for row in _some(rng, recording):
        values[row] = values[row - 1]
    return replace(recording, values=values), None


def _backwards(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    rows = np.arange(len(recording.times))
    for row in _some(rng, recording)[::2]:
        rows[[row, row + 1]] = rows[[row + 1, row]]
    return _rows(recording, rows), None


def _twice(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    rows = np.tile(np.arange(len(clean.recording.times)), 2)
    return _rows(clean.recording, rows), None


def _jitter(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    even = replace(recording, times=np.linspace(0, recording.times[-1], len(recording.times)))
    values = np.stack([np.interp(even.times, recording.times, column) for column in recording.values.T], axis=1)
    off = rng.uniform(-0.4, 0.4, len(values)) * _step(even)
    return replace(even, times=even.times + off, values=values), None


def _gap(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    length = max(rng.uniform(0.03, 0.2) * np.ptp(recording.times), 6 * _step(recording))
    start = rng.uniform(0.1, 0.7) * np.ptp(recording.times)
    inside = (recording.times > start) & (recording.times < start + length)
    return _rows(recording, np.flatnonzero(~inside)), None


def _wrap(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    number = int(rng.choice(np.flatnonzero(np.ptp(recording.values, axis=0) > 0.1)))
    values = recording.values.copy()
    low, high = values[:, number].min(), values[:, number].max()
    turned = values[:, number] + np.pi - rng.uniform(low + 0.2 * (high - low), high - 0.2 * (high - low))
    values[:, number] = (turned + np.pi) % (2 * np.pi) - np.pi
    unit = None
    if rng.integers(2):
        values, unit = np.degrees(values), "deg"
    return replace(recording, values=values, unit=unit), recording.columns[number]


def _spike(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    number = int(rng.integers(len(recording.columns)))
    values = recording.values.copy()
    places = rng.choice(np.arange(5, len(values) - 8, 12), int(rng.integers(1, 5)), replace=False)
    for row in places.tolist():
        count = int(rng.integers(1, 4))
        values[row : row + count, number] += rng.choice([-1, 1]) * rng.uniform(0.1, 1.0)
    return replace(recording, values=values), recording.columns[number]


def _frozen(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    count, values = len(recording.times), recording.values.copy()
    start = int(rng.uniform(0.2, 0.5) * count)
    last = start + max(int(rng.uniform(0.1, 0.4) * count), 6)
    number = int(np.argmax(np.abs(values[last] - values[start]) * rng.uniform(0.5, 1.0, values.shape[1])))
    values[start:last, number] = values[start, number]
    return replace(recording, values=values), recording.columns[number]


def _dead(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    number = int(rng.integers(len(recording.columns)))
    values = recording.values.copy()
    values[:, number] = values[0, number]
    return replace(recording, values=values), recording.columns[number]


def _gripper(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    name = str(rng.choice(["gripper", "panda_finger_joint1", "left_gripper.pos", "robotiq_85_left_knuckle_joint"]))
    closing = np.clip(4 * np.sin(3 * recording.times / recording.times[-1] + rng.uniform(0, 6)), 0, 1)
    at = int(rng.integers(len(recording.columns) + 1))
    columns = (*recording.columns[:at], name, *recording.columns[at:])
    return replace(recording, columns=columns, values=np.insert(recording.values, at, closing, axis=1)), name


def _degrees(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    return replace(clean.recording, values=np.degrees(clean.recording.values), unit=None), None


def _named_order(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    order = rng.permutation(len(recording.columns))
    if np.all(order == np.arange(len(order))):
        order = order[::-1]
    columns = tuple(recording.columns[number] for number in order)
    return replace(recording, columns=columns, values=recording.values[:, order]), None


def _repeated_frames(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording, _ = _same_stamp(rng, clean)
    times = np.arange(len(recording.times)) * _step(clean.recording)
    return replace(recording, times=times), None


def _lost_frames(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    recording = clean.recording
    keep = np.setdiff1d(np.arange(len(recording.times)), _some(rng, recording))
    kept = _rows(recording, keep)
    return replace(kept, times=np.arange(len(keep)) * _step(recording)), None


def _stutter(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    """Samples taken up to 1.5 steps early or late, with evenly spaced stamps."""
    recording = clean.recording
    stamps = np.linspace(0, recording.times[-1], len(recording.times))
    taken = stamps.copy()
    taken[1:-1] += rng.uniform(-1.5, 1.5, len(stamps) - 2) * _step(recording)
    taken = np.sort(np.clip(taken, 0, stamps[-1]))
    values = np.stack([np.interp(taken, recording.times, column) for column in recording.values.T], axis=1)
    return replace(recording, times=stamps, values=values), None


def _too_fast(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    return replace(clean.recording, times=1e-3 * clean.recording.times), None


def _too_slow(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    return replace(clean.recording, times=1e3 * clean.recording.times), None


def _cut(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    """Cut the recording where some joint moves fast."""
    recording = clean.recording
    speed = np.abs(np.gradient(recording.values, recording.times, axis=0)).max(axis=1)
    smooth = np.convolve(speed, np.ones(5) / 5, mode="same")
    count = len(smooth)
    begin, end = (int(a + np.argmax(smooth[a:b])) for a, b in ((count // 10, count // 3), (count // 2, -count // 10)))
    rows = np.arange(begin, count) if rng.integers(2) else np.arange(end)
    return _rows(recording, rows), None


def _in_turn(rng: np.random.Generator, clean: Clean) -> tuple[Recording, str | None]:
    """Samples of the arm and of another one with the same movement elsewhere, in turn."""
    values = clean.recording.values.copy()
    values[int(rng.integers(2)) :: 2] += rng.uniform(0.1, 1.0, values.shape[1]) * rng.choice(
        (-1.0, 1.0), values.shape[1]
    )
    return replace(clean.recording, values=values), None


MUTATIONS: tuple[Mutation, ...] = (
    Mutation("idle", "idle for 0.2 to 2 times the movement, before it, after it or both", _idle, repaired=True),
    Mutation("duplicates", "5 % of the samples twice, with one stamp", _same_stamp, repaired=True),
    Mutation("duplicates", "5 % of the samples repeat the one before", _repeated, base="quiet", repaired=True),
    Mutation("backwards", "samples exchanged with the next", _backwards, repaired=True),
    Mutation("backwards", "two recordings in one file", _twice),
    Mutation("interleaved", "samples of two arms in turn, 0.1 to 1 rad apart", _in_turn),
    Mutation("jitter", "even samples, stamps off by up to 0.4 of a step", _jitter, base="quiet", repaired=True),
    Mutation("gap", "3 to 20 % of the time without samples", _gap),
    Mutation("wraps", "one joint wrapped at ±π or ±180°", _wrap, repaired=True),
    Mutation("spikes", "1 to 4 outliers of 0.1 to 1 rad, 1 to 3 samples long", _spike, repaired=True),
    Mutation("frozen", "one joint stopped for 10 to 40 % of the time", _frozen),
    Mutation("frozen", "one joint dead from the beginning, others with noise", _dead, base="noisy"),
    Mutation(COLUMNS, "a gripper's column, named, anywhere", _gripper, repaired=True),
    Mutation("degrees", "degrees, no unit named", _degrees, repaired=True),
    Mutation(COLUMNS, "joints in another order, named", _named_order, repaired=True),
    Mutation(
        "synthetic", "5 % of the frames twice, stamped evenly afterwards", _repeated_frames, base="quiet", repaired=True
    ),
    Mutation("synthetic", "5 % of the frames lost, stamped evenly afterwards", _lost_frames, base="quiet"),
    Mutation("stutter", "samples up to 1.5 steps early or late, stamped evenly", _stutter, base="quiet", repaired=True),
    Mutation("speed", "stamps a thousand times too short", _too_fast),
    Mutation("speed", "stamps in ms", _too_slow),
    Mutation("moving", "begins or ends where the arm moves fast", _cut),
)


def _step(recording: Recording) -> float:
    return float(np.median(np.diff(recording.times)))


def _some(rng: np.random.Generator, recording: Recording) -> np.ndarray:
    """Indices of 5 % of the samples, at least two, no two adjacent, none at an end."""
    count = len(recording.times)
    candidates = np.arange(4, count - 4, 3) + int(rng.integers(3))
    candidates = candidates[candidates < count - 3]
    return np.sort(rng.choice(candidates, max(2, count // 20), replace=False))


def _rows(recording: Recording, rows: np.ndarray) -> Recording:
    return replace(recording, times=recording.times[rows], values=recording.values[rows])
