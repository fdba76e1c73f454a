"""Clean recordings: real ones, and smooth movements sampled at several rates, noise levels and resolutions."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np

from benchmarks.learning import DEMO_DURATION, DEMOS
from benchmarks.recordings import TWELVE_BITS
from experiments.imitation.recorded import letters
from motion.limits import Limits
from robot.description import load_robot
from robot.shipped import DEMONSTRATIONS
from tools.recordings.doctor import Arm
from tools.recordings.recording import Recording

Base = Literal["any", "quiet", "noisy"]

RATES = 30.0, 50.0, 100.0, 250.0, 500.0, 1000.0
NOISES = 0.0, 1e-4, 5e-4, 1e-3
STUTTERING = "platestandingtolying", "pouring"
"""Household tasks with jitter common to all joints: a fault that the doctor must find."""

RESOLUTIONS = 0.0, TWELVE_BITS / 16, TWELVE_BITS

PANDA = Arm(
    tuple(f"q{joint}" for joint in range(1, 8)),
    Limits(
        np.array([[-2.9, 2.9], [-1.77, 1.77], [-2.9, 2.9], [-3.08, -0.06], [-2.9, 2.9], [-0.02, 3.76], [-2.9, 2.9]]),
        np.array([2.175] * 4 + [2.61] * 3),
        np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0]),
        np.array([7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0]),
    ),
)
"""Ranges, rad, and limits of the arm of the real recordings, from its maker's data sheet."""


@dataclass(frozen=True, slots=True, eq=False)
class Clean:
    """A clean recording of an arm. `moving`: it begins or ends in motion, which the doctor must report.

    noise: rad; resolution: rad, of a synthetic recording.
    """

    recording: Recording
    arm: Arm
    moving: bool = False
    noise: float = 0.0
    resolution: float = 0.0


def shipped() -> Arm:
    """The shipped arm."""
    robot = load_robot()
    return Arm(robot.joint_names, robot.limits)


def synthetic(rng: np.random.Generator, arm: Arm, base: Base = "any") -> Clean:
    """A smooth movement from rest to rest: overlapping minimum-jerk strokes, sampled as a recording program would.

    `base`: "quiet" without noise, "noisy" with noise; both only have the resolution of floats.
    """
    rate, noise, resolution = (float(rng.choice(some)) for some in (RATES, NOISES, RESOLUTIONS))
    if base != "any":
        noise, resolution = 0.0 if base == "quiet" else max(noise, 1e-4), 0.0
    duration = rng.uniform(2.0, 8.0)
    times = np.arange(round(rate * duration) + 1) / rate
    jitter = rng.choice([0.0, 0.0, 0.2])
    times[1:-1] += rng.uniform(-jitter, jitter, len(times) - 2) / rate
    values = np.stack(
        [_joint(rng, times, low, high, speed) for low, high, speed in zip(*_scales(arm), strict=True)], axis=1
    )
    values += noise * rng.standard_normal(values.shape)
    if resolution:
        values = np.round(values / resolution) * resolution
    recording = Recording(times, arm.joint_names, values, None, Path("synthetic"), "0", True)
    return Clean(recording, arm, False, noise, resolution)


def real() -> Iterator[Clean]:
    """Recordings of people and arms: the shipped forehand, and household tasks and letters if their files exist."""
    arm = shipped()
    forehand = DEMONSTRATIONS / "forehand.csv"
    table = np.loadtxt(forehand, delimiter=",", skiprows=1)
    yield Clean(Recording(table[:, 0], arm.joint_names, table[:, 1:], "rad", forehand, "0", True), arm, moving=True)
    for path in sorted(DEMOS.glob("*.csv")):
        if any(name in path.stem for name in STUTTERING):
            continue
        table = np.loadtxt(path, delimiter=",", skiprows=1)
        times = DEMO_DURATION * table[:, 0]
        yield Clean(Recording(times, PANDA.joint_names, table[:, 1:], None, path, "0", True), PANDA, moving=True)
    paper = Arm(("x", "y"), Limits.unlimited(2))
    for number, shapes in enumerate(letters()):
        if number % 8 == 0:
            shown = shapes[0].demonstration
            recording = Recording(shown.times, ("x", "y"), shown.positions, "rad", Path(shapes[0].name), "0", True)
            yield Clean(recording, paper, moving=True)


def thirty(seed: int) -> list[Clean]:
    """Thirty clean recordings: the real ones, and synthetic ones of two arms."""
    rng = np.random.default_rng(seed)
    found = list(real())
    arms = shipped(), PANDA
    return found + [synthetic(rng, arms[number % 2]) for number in range(30 - len(found))]


def _scales(arm: Arm) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lowest and highest positions (J,), rad, of a movement, and its approximate largest speeds (J,), rad/s."""
    low, high = np.clip(arm.limits.positions, -3.0, 3.0).T
    margin = 0.15 * (high - low)
    return low + margin, high - margin, np.minimum(0.5 * arm.limits.velocities, 3.0)


def _joint(rng: np.random.Generator, times: np.ndarray, low: float, high: float, speed: float) -> np.ndarray:
    """One joint: three to six strokes; the first begins at the first sample, the last ends at the last."""
    duration, strokes = times[-1], int(rng.integers(3, 7))
    places = rng.uniform(low, high, strokes + 1)
    values = np.full(len(times), places[0])
    length = 1.6 * duration / strokes
    for number, (here, there) in enumerate(pairwise(places)):
        start = (duration - length) * number / (strokes - 1)
        far = np.clip(there - here, -0.4 * speed * length, 0.4 * speed * length)
        s = np.clip((times - start) / length, 0, 1)
        values += far * s**3 * (10 + s * (6 * s - 15))
    lowest, highest = values.min(), values.max()
    shrunk = min(1.0, (high - low) / max(highest - lowest, 1e-9))
    values = lowest + shrunk * (values - lowest)
    return values + max(low - values.min(), 0.0) - max(values.max() - high, 0.0)
