"""What the teacher of a movement should know about a recording, in sentences."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.special import stdtrit

from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.primitive import Primitive
from motion.request import MIN_PLACE_TIME
from motion.smoothing import run_length
from robot.recordings.plausibility import beyond_limits, garbled, jumps, outside, too_fast

PLACE_SHARE, PLACE_FLOOR = 0.01, 0.005
"""Distance between a motion and its demonstration that is worth a sentence: part of the joint's range, or rad."""

SPREAD = 4 / 27
"""Largest distance, in units of velocity × duration, when a motion begins or ends at rest that did not."""

UNSURE = 10.0
"""Times the noise: the velocity at an end is known no better."""

END_SHARE, END_SAMPLES, CHANCE = 0.05, 10, 1e-5
"""Part of the samples, and least number of them, that show a joint in motion at an end, and the chance of an error."""

GAP = 5.0
"""Times the usual distance between two samples."""

LISTED = 3


def warnings_of(demonstration: Demonstration, primitive: Primitive, limits: Limits, names: Sequence[str]) -> list[str]:
    """Sentences about a recording and the primitive learned from it; empty for a clean one.

    `limits` and joint `names` are the arm's; a recording of another number of joints is not held against limits.
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
    ]


def moving_ends(demonstration: Demonstration, primitive: Primitive, names: Sequence[str]) -> Iterator[str]:
    """Sentences where the movement begins or ends so fast that a start or goal at rest shifts its places."""
    tolerance = np.maximum(_tolerance(primitive), UNSURE * primitive.noise_estimate)
    times, positions = demonstration.times, demonstration.positions
    for verb, boundary, end, order in (("begins", primitive.start, "start", 1), ("ends", primitive.goal, "goal", -1)):
        moves = _moves(times[::order], positions[::order])
        shift = np.where(moves, SPREAD * primitive.duration * np.abs(boundary.velocities), 0.0)
        shift[shift <= tolerance] = 0.0
        joint = int(np.argmax(shift))
        if shift[joint] > 0:
            yield (
                f"the demonstration {verb} moving: {names[joint]} at {boundary.velocities[joint]:.3g} rad/s; "
                f"a {end} at rest shifts the motion by up to {shift[joint]:.2g} rad on the way, or, with a "
                f"place_time of {MIN_PLACE_TIME:g} s, only near it"
            )


def _moves(times: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Whether each joint (J,) moves at the first sample, by a cubic through the first ones and its standard error."""
    count = max(END_SAMPLES, round(END_SHARE * len(times)))
    since = (times[:count] - times[0]) / (times[count - 1] - times[0])
    powers = np.vander(since, 4, increasing=True)
    fitted = np.linalg.lstsq(powers, positions[:count])[0]
    # Neighbours on one step of a quantised encoder have one error and count as one.
    correlation = np.array([run_length(column) for column in positions[:count].T])
    free = np.maximum(count / correlation - 4, 1.0)
    variance = correlation * np.mean((positions[:count] - powers @ fitted) ** 2, axis=0) * (1 + 4 / free)
    error = np.sqrt(variance * np.linalg.inv(powers.T @ powers)[1, 1])
    return np.abs(fitted[1]) > stdtrit(free, 1 - CHANCE) * error


def gaps(demonstration: Demonstration, primitive: Primitive) -> Iterator[str]:
    """A sentence on stretches without samples that are longer than half the distance between two knots."""
    steps = np.diff(demonstration.times)
    knot = primitive.duration / (primitive.basis_count - 3)
    rows = np.flatnonzero(steps > max(GAP * float(np.median(steps)), knot / 2))
    if len(rows):
        yield filled_gaps(demonstration.times, rows)


def filled_gaps(times: np.ndarray, rows: np.ndarray) -> str:
    """Return a sentence on the gaps that follow the samples `rows`; times (n,), s."""
    steps, since = np.diff(times), times - times[0]
    longest = sorted(rows[np.argsort(-steps[rows], kind="stable")][:LISTED].tolist())
    listed = ", ".join(f"{steps[row]:.3g} s after {since[row]:.3g} s" for row in longest)
    rest = f" and {len(rows) - LISTED} more" if len(rows) > LISTED else ""
    return f"samples are missing and the spline fills the gaps: {listed}{rest}"


def not_followed(demonstration: Demonstration, primitive: Primitive, names: Sequence[str]) -> Iterator[str]:
    """Sentences for joints whose spline passes beside the samples by more than their noise explains."""
    s = demonstration.phases
    beside = primitive.positions(s) - demonstration.positions
    # Noise averages out over half a knot interval, what the spline cannot follow does not.
    width = max(1, len(s) // (2 * (primitive.basis_count - 3)))
    sums = np.cumsum(np.pad(beside, ((1, 0), (0, 0))), axis=0)
    beside = np.abs(sums[width:] - sums[:-width]).max(axis=0) / width
    # What differs from sample to sample is noise: its standard deviation by the median of the second differences.
    noise = np.median(np.abs(np.diff(demonstration.positions, n=2, axis=0)), axis=0) / 0.6745 / np.sqrt(6)
    tolerance = np.maximum(_tolerance(primitive), 2 * noise)
    for joint in np.flatnonzero(beside > tolerance).tolist():
        yield (
            f"{names[joint]} cannot be followed: the spline passes {primitive.position_max[joint]:.2g} rad beside its "
            "samples; record the movement in parts, or look for jumps in it"
        )


def _tolerance(primitive: Primitive) -> np.ndarray:
    """Distance (J,), rad, that is worth a sentence."""
    positions = primitive.positions(np.linspace(0, 1, 1001))
    return np.maximum(PLACE_SHARE * np.ptp(positions, axis=0), PLACE_FLOOR)
