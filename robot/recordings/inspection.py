"""Warnings about a recording and the primitive learned from it, in sentences."""

from collections.abc import Iterator, Sequence
from typing import SupportsFloat

import numpy as np
from scipy.special import stdtrit

from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.primitive import Primitive
from motion.request import MIN_PLACE_TIME
from motion.smoothing import run_length
from robot.recordings.plausibility import beyond_limits, garbled, jumps, outside, too_fast

PLACE_SHARE, PLACE_FLOOR = 0.01, 0.005
"""Distance between a motion and its demonstration that causes a warning: fraction of the joint's range, or rad."""

SPREAD = 4 / 27
"""Largest deviation, in units of velocity × duration, if a moving start or end is replaced by rest."""

UNSURE = 10.0
"""Uncertainty of the velocity at an end, in units of the noise."""

END_SHARE, END_SAMPLES, CHANCE = 0.05, 10, 1e-5
"""Fraction and least number of samples that decide whether a joint moves at an end, and the error probability."""

RESTS = 0.5
"""Fraction of the distance expected by its velocity below which a joint rests at an end."""

GAP = 5.0
"""Length of a gap, in units of the usual distance between two samples."""

LISTED = 3

NOISY = 0.05
"""Standard deviation of the samples' noise, rad, that causes a warning."""


def warnings_of(demonstration: Demonstration, primitive: Primitive, limits: Limits, names: Sequence[str]) -> list[str]:
    """Return warnings about a recording and the primitive learned from it; empty for a clean one.

    `limits` and joint `names` are the arm's; a recording with another number of joints is not checked against limits.
    """
    if limits.joint_count != (joint_count := primitive.joint_count):
        names, limits = [f"joint {joint}" for joint in range(joint_count)], Limits.unlimited(joint_count)
    return [
        *garbled(demonstration),
        *jumps(demonstration, names),
        *outside(demonstration, limits, names),
        *too_fast(demonstration, primitive, limits, names),
        *beyond_limits(primitive, limits, names),
        *moving_ends(demonstration, primitive, names),
        *gaps(demonstration, primitive),
        *not_followed(demonstration, primitive, names),
        *noisy(demonstration, names),
    ]


def moving_ends(demonstration: Demonstration, primitive: Primitive, names: Sequence[str]) -> Iterator[str]:
    """Yield warnings if the movement starts or ends so fast that a start or goal at rest shifts its positions."""
    tolerance = np.maximum(_tolerance(primitive), UNSURE * primitive.noise_estimate)
    times, positions = demonstration.times, demonstration.positions
    for verb, boundary, end, order in (("begins", primitive.start, "start", 1), ("ends", primitive.goal, "goal", -1)):
        moves = _moves(times[::order], positions[::order])
        shift = np.where(moves, SPREAD * primitive.duration * np.abs(boundary.velocities), 0.0)
        shift[shift <= tolerance] = 0.0
        shift[_rests(times[::order], positions[::order], boundary.velocities)] = 0.0
        joint = int(np.argmax(shift))
        if shift[joint] > 0:
            yield (
                f"the demonstration {verb} moving: {names[joint]} at {boundary.velocities[joint]:.3g} rad/s; "
                f"a {end} at rest shifts the motion by up to {shift[joint]:.2g} rad on the way, or, with a "
                f"place_time of {MIN_PLACE_TIME:g} s, only near it"
            )


def _moves(times: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return whether each joint (J,) moves at the first sample: a cubic is fitted and tested by its standard error."""
    count = max(END_SAMPLES, round(END_SHARE * len(times)))
    since = (times[:count] - times[0]) / (times[count - 1] - times[0])
    powers = np.vander(since, 4, increasing=True)
    fitted = np.linalg.lstsq(powers, positions[:count])[0]
    # Adjacent samples on one step of a quantised encoder share their error, so they count as one.
    correlation = np.array([run_length(column) for column in positions[:count].T])
    free = np.maximum(count / correlation - 4, 1.0)
    variance = correlation * np.mean((positions[:count] - powers @ fitted) ** 2, axis=0) * (1 + 4 / free)
    error = np.sqrt(variance * np.linalg.inv(powers.T @ powers)[1, 1])
    return np.abs(fitted[1]) > stdtrit(free, 1 - CHANCE) * error


def _rests(times: np.ndarray, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    """Return whether each joint (J,) moves so little in the first samples that it cannot have such a velocity.

    The spline of an examination has few functions, and its velocity at an end is that of a long part of the movement.
    """
    moved = np.abs(positions[END_SAMPLES - 1] - positions[0])
    expected = np.abs(velocities * (times[END_SAMPLES - 1] - times[0]))
    return moved + UNSURE * _sample_noise(positions) < RESTS * expected


def _sample_noise(positions: np.ndarray) -> np.ndarray:
    """Return the standard deviation (J,) of the samples' noise, by the median of the second differences."""
    return np.median(np.abs(np.diff(positions, n=2, axis=0)), axis=0) / 0.6745 / np.sqrt(6)


def gaps(demonstration: Demonstration, primitive: Primitive) -> Iterator[str]:
    """Yield a warning about gaps that are longer than half a knot interval."""
    steps = np.diff(demonstration.times)
    knot = primitive.duration / (primitive.basis_count - 3)
    rows = np.flatnonzero(steps > max(GAP * float(np.median(steps)), knot / 2))
    if len(rows):
        yield filled_gaps(demonstration.times, rows)


def spoken_time(time: SupportsFloat) -> str:
    """Return a time of a recording, s, to the millisecond and as in the file, where the reader looks for it."""
    return f"{round(float(time), 3):.12g} s"


def filled_gaps(times: np.ndarray, rows: np.ndarray) -> str:
    """Return a sentence about the gaps after the samples `rows`; times: (n,), s."""
    steps = np.diff(times)
    longest = sorted(rows[np.argsort(-steps[rows], kind="stable")][:LISTED].tolist())
    listed = ", ".join(f"{steps[row]:.3g} s after {spoken_time(times[row])}" for row in longest)
    rest = f" and {len(rows) - LISTED} more" if len(rows) > LISTED else ""
    return f"samples are missing and the spline fills the gaps: {listed}{rest}"


def not_followed(demonstration: Demonstration, primitive: Primitive, names: Sequence[str]) -> Iterator[str]:
    """Yield warnings about joints whose spline is farther from the samples than their noise explains."""
    s = demonstration.phases
    deviations = primitive.positions(s) - demonstration.positions
    # Noise averages out over half a knot interval; a misfit of the spline does not.
    width = max(1, len(s) // (2 * (primitive.basis_count - 3)))
    sums = np.cumsum(np.pad(deviations, ((1, 0), (0, 0))), axis=0)
    deviations = np.abs(sums[width:] - sums[:-width]).max(axis=0) / width
    tolerance = np.maximum(_tolerance(primitive), 2 * _sample_noise(demonstration.positions))
    for joint in np.flatnonzero(deviations > tolerance).tolist():
        yield (
            f"{names[joint]} cannot be followed: the spline passes {primitive.position_max[joint]:.2g} rad beside its "
            "samples; record the movement in parts, or look for jumps in it"
        )


def noisy(demonstration: Demonstration, names: Sequence[str]) -> Iterator[str]:
    """Yield warnings about joints whose samples are noise rather than a movement."""
    noise = _sample_noise(demonstration.positions)
    for joint in np.flatnonzero(noise > NOISY).tolist():
        yield (
            f"{names[joint]} has noise of {noise[joint]:.2g} rad (standard deviation), of which the spline keeps the "
            "mean; look for a loose sensor or samples of two movements in turn, and record it again"
        )


def _tolerance(primitive: Primitive) -> np.ndarray:
    """Return the distance (J,), rad, that causes a warning."""
    positions = primitive.positions(np.linspace(0, 1, 1001))
    return np.maximum(PLACE_SHARE * np.ptp(positions, axis=0), PLACE_FLOOR)
