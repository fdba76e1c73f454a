"""Faults of the movement: idle ends, ends in motion, speeds that no arm has."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from motion.demonstration import Demonstration
from motion.primitive import Primitive, learn
from robot.recordings.inspection import moving_ends
from robot.recordings.plausibility import too_fast
from tools.recordings.doctor.finding import Finding, Robot
from tools.recordings.doctor.signals import noise, resolution
from tools.recordings.recording import Recording

STILL_SHARE, STILL_NOISE, STILL_STEPS = 1e-3, 7.0, 1.5
"""A joint stands still within this part of its range, this many times its averaged noise, and so many resolutions."""

AVERAGED = 0.02
"""Part of the samples over which noise is averaged."""

IDLE_SHARE, IDLE_FLOOR = 0.1, 0.3
"""An end is idle where it stands still for longer than this part of the movement, and than this, s."""

SETTLED = 0.1
"""Rest that is left at an end, s."""

NOTHING = 1e-3
"""A recording in which no joint goes farther than this, rad, shows no movement."""

FUNCTIONS = 20, 60
"""Functions of the spline that is asked about ends and speeds; more take longer and say no more of them."""

SLOW, LONG = 1e-3, 60.0
"""A recording is slow where no joint reaches this part of its velocity limit and it takes longer than this, s."""


def still(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """A recording without movement."""
    widest = float(np.ptp(recording.values, axis=0).max(initial=0.0))
    if widest < NOTHING:
        sentence = f"no joint moves farther than {widest:.2g} rad: the recording shows no movement"
        yield Finding(sentence, fatal=True)


def idle_ends(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Stretches before and after the movement in which nothing moves."""
    times, values = recording.times, recording.values
    begin, end = _onset(times, values), len(times) - 1 - _onset(-times[::-1], values[::-1])
    moving = times[end] - times[begin]
    least = max(IDLE_SHARE * moving, IDLE_FLOOR)
    for name, idle, rows in (
        ("beginning", times[begin] - times[0], np.arange(_back(times, begin))),
        ("end", times[-1] - times[end], np.arange(_on(times, end) + 1, len(times))),
    ):
        if begin < end and idle > least and len(rows):
            sentence = f"nothing moves for {idle:.3g} s at the {name}: trimmed to {SETTLED:g} s"
            yield Finding(sentence, True, rows=rows)


def ends_in_motion(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """A beginning or an end at which the arm moves."""
    primitive = _look(recording)
    for sentence in moving_ends(Demonstration(recording.times, recording.values), primitive, recording.columns):
        first = "begins" in sentence
        rows = np.array([0 if first else len(recording.times) - 1])
        yield Finding(sentence, rows=rows, planner_says=True)


def speeds(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Movements that are too fast for the arm by far, or slower than anybody moves one."""
    if robot is None:
        return
    primitive = _look(recording)
    demonstration = Demonstration(recording.times, recording.values)
    for sentence in too_fast(demonstration, primitive, robot.limits, robot.joint_names):
        yield Finding(sentence, planner_says=True)
    fastest = np.abs(primitive.sample(np.linspace(0, 1, 201)).velocities).max(axis=0)
    share = float((fastest / robot.limits.velocities).max())
    if share < SLOW and primitive.duration > LONG:
        sentence = (
            f"the movement takes {primitive.duration:.4g} s and reaches {share:.1g} of the velocity limits; "
            "are the stamps in ms? Give --duration with its time in s"
        )
        yield Finding(sentence)


@lru_cache(maxsize=1)
def _look(recording: Recording) -> Primitive:
    """A spline of the recording that is good enough for its ends and speeds."""
    least, most = FUNCTIONS
    count = int(np.clip(len(recording.times) - 2, least, most))
    return learn(Demonstration(recording.times, recording.values), basis_count=count)


def _onset(times: np.ndarray, values: np.ndarray) -> int:
    """Index of the last sample at which every joint is still where it began."""
    width = max(1, round(AVERAGED * len(values)))
    sums = np.cumsum(np.pad(values - values[0], ((1, 0), (0, 0))), axis=0)
    averaged = (sums[width:] - sums[:-width]) / width
    sizes = np.maximum(STILL_NOISE * noise(times, values) / np.sqrt(width), STILL_STEPS * resolution(values))
    tolerance = np.maximum(STILL_SHARE * np.ptp(values, axis=0), sizes)
    moved = np.any(np.abs(averaged - averaged[0]) > tolerance, axis=1)
    return max(int(np.argmax(moved)) - 1, 0) if moved.any() else len(values) - 1


def _back(times: np.ndarray, begin: int) -> int:
    """Index of the first sample that is kept."""
    return min(int(np.searchsorted(times, times[begin] - SETTLED)), max(begin - 2, 0))


def _on(times: np.ndarray, end: int) -> int:
    """Index of the last sample that is kept."""
    return max(int(np.searchsorted(times, times[end] + SETTLED)), min(end + 2, len(times) - 1))
