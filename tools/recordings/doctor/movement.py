"""Faults of the movement: idle ends, ends in motion, implausible speeds."""

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
"""A joint is at rest within the largest of this fraction of the largest range of a joint, this multiple of its averaged
noise, and this multiple of its resolution."""

AVERAGED = 0.02
"""Fraction of the samples over which noise is averaged."""

IDLE_FRACTION, IDLE_FLOOR = 0.1, 0.3
"""An end is idle if its rest is longer than this fraction of the movement and than this, s."""

SETTLED = 0.1
"""Rest that remains at an end, s."""

NOTHING = 1e-3
"""Largest travel of any joint, rad, of a recording without movement."""

FUNCTIONS = 20, 60
"""Least and largest number of basis functions of the spline for ends and speeds; more are slower and no more exact."""

SLOW, LONG = 1e-3, 60.0
"""A recording is too slow if no joint reaches this fraction of its velocity limit and it is longer than this, s."""


def still(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find a recording without movement."""
    widest = float(np.ptp(recording.values, axis=0).max(initial=0.0))
    if widest < NOTHING:
        sentence = f"no joint moves farther than {widest:.2g} rad: the recording shows no movement"
        yield Finding(sentence, fatal=True)


def idle_ends(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find rest before and after the movement."""
    times, values = recording.times, recording.values
    begin, end = _onset(times, values), len(times) - 1 - _onset(-times[::-1], values[::-1])
    moving = times[end] - times[begin]
    least = max(IDLE_FRACTION * moving, IDLE_FLOOR)
    for name, idle, rows in (
        ("beginning", times[begin] - times[0], np.arange(_back(times, begin))),
        ("end", times[-1] - times[end], np.arange(_on(times, end) + 1, len(times))),
    ):
        if begin < end and idle > least and len(rows):
            sentence = f"nothing moves for {idle:.3g} s at the {name}: trimmed to {SETTLED:g} s"
            yield Finding(sentence, True, rows=rows)


def ends_in_motion(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find a beginning or an end at which the arm moves."""
    primitive = _rough_primitive(recording)
    for sentence in moving_ends(Demonstration(recording.times, recording.values), primitive, recording.columns):
        first = "begins" in sentence
        rows = np.array([0 if first else len(recording.times) - 1])
        yield Finding(sentence, rows=rows, planner_warns=True)


def speeds(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find speeds far above the arm's limits, and implausibly slow movements."""
    if robot is None:
        return
    primitive = _rough_primitive(recording)
    demonstration = Demonstration(recording.times, recording.values)
    for sentence in too_fast(demonstration, primitive, robot.limits, robot.joint_names):
        yield Finding(sentence, planner_warns=True)
    fastest = np.abs(primitive.sample(np.linspace(0, 1, 201)).velocities).max(axis=0)
    fraction = float((fastest / robot.limits.velocities).max())
    if fraction < SLOW and primitive.duration > LONG:
        sentence = (
            f"the movement takes {primitive.duration:.4g} s and reaches {fraction:.1g} of the velocity limits; "
            "are the stamps in ms? Give --duration with its time in s"
        )
        yield Finding(sentence)


@lru_cache(maxsize=1)
def _rough_primitive(recording: Recording) -> Primitive:
    """Return a spline of the recording with few functions, for its ends and speeds."""
    least, most = FUNCTIONS
    count = int(np.clip(len(recording.times) - 2, least, most))
    return learn(Demonstration(recording.times, recording.values), basis_count=count)


def _onset(times: np.ndarray, values: np.ndarray) -> int:
    """Return the index of the last sample at which no joint has moved from its first position."""
    width = max(1, round(AVERAGED * len(values)))
    sums = np.cumsum(np.pad(values - values[0], ((1, 0), (0, 0))), axis=0)
    averaged = (sums[width:] - sums[:-width]) / width
    sizes = np.maximum(STILL_NOISE * noise(times, values) / np.sqrt(width), STILL_STEPS * resolution(values))
    tolerance = np.maximum(STILL_SHARE * np.ptp(values, axis=0).max(), sizes)
    moved = np.any(np.abs(averaged - averaged[0]) > tolerance, axis=1)
    return max(int(np.argmax(moved)) - 1, 0) if moved.any() else len(values) - 1


def _back(times: np.ndarray, begin: int) -> int:
    """Return the index of the first sample to keep."""
    return min(int(np.searchsorted(times, times[begin] - SETTLED)), max(begin - 2, 0))


def _on(times: np.ndarray, end: int) -> int:
    """Return the index of the last sample to keep."""
    return max(int(np.searchsorted(times, times[end] + SETTLED)), min(end + 2, len(times) - 1))
