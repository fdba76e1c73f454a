"""What the teacher of a movement should know about a recording, in sentences."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.primitive import Primitive

PLACE_SHARE, PLACE_FLOOR = 0.01, 0.005
"""Distance between a motion and its demonstration that is worth a sentence: part of the joint's range, or rad."""

SPREAD = 4 / 27
"""Largest distance, in units of velocity × duration, when a motion begins or ends at rest that did not."""

GAP = 5.0
"""Times the usual distance between two samples."""

FAST = 10.0
"""Times a velocity limit: no joint moves like that."""

OUTSIDE = 0.02
"""rad: an arm may be calibrated, or pushed, this far outside its range."""

TURN_TOLERANCE = 0.5
"""rad: a jump within this of a full turn is a wrapped angle."""

GARBLED = 0.2
"""A matrix whose columns wander less than this part of the way when its bytes are read otherwise was garbled."""

LISTED = 3


def warnings_of(demonstration: Demonstration, primitive: Primitive, limits: Limits, names: Sequence[str]) -> list[str]:
    """Sentences about a recording and the primitive learned from it; empty for a clean one.

    `limits` and joint `names` are the arm's; a recording of another number of joints is not held against limits.
    """
    if limits.joint_count != primitive.joint_count:
        names, limits = [f"joint {joint}" for joint in range(primitive.joint_count)], None
    sentences = [*garbled(demonstration), *jumps(demonstration, names)]
    if limits is not None:
        sentences += [*outside(demonstration, limits, names), *too_fast(demonstration, primitive, limits, names)]
    return [
        *sentences,
        *moving_ends(primitive, names),
        *gaps(demonstration, primitive),
        *not_followed(demonstration, primitive, names),
    ]


def moving_ends(primitive: Primitive, names: Sequence[str]) -> Iterator[str]:
    """Sentences where the movement begins or ends so fast that a start or goal at rest shifts its places."""
    for verb, boundary, end in (("begins", primitive.start, "start"), ("ends", primitive.goal, "goal")):
        shift = SPREAD * primitive.duration * np.abs(boundary.velocities)
        joint = int(np.argmax(shift / _tolerance(primitive)))
        if shift[joint] > _tolerance(primitive)[joint]:
            yield (
                f"the demonstration {verb} moving: {names[joint]} at {boundary.velocities[joint]:.3g} rad/s; "
                f"a {end} at rest shifts the motion by up to {shift[joint]:.2g} rad on the way"
            )


def outside(demonstration: Demonstration, limits: Limits, names: Sequence[str]) -> Iterator[str]:
    """A sentence where samples lie outside position ranges, with a guess at the cause."""
    excess = _excess(demonstration.positions, limits.positions)
    joint = int(np.argmax(np.diagonal(excess)))
    if excess[joint, joint] <= OUTSIDE:
        return
    low, high = limits.positions[joint]
    column = demonstration.positions[:, joint]
    value = column[np.argmax(np.maximum(column - high, low - column))]
    sentence = f"{names[joint]} reaches {value:.4g} rad, outside its range of {low:.4g} to {high:.4g} rad"
    order = linear_sum_assignment(excess)[1]
    degrees = _excess(np.radians(demonstration.positions), limits.positions)
    if value > 2 * np.pi + high and np.diagonal(degrees).max() <= OUTSIDE:
        sentence += "; are the positions in degrees?"
    elif excess[np.arange(len(order)), order].max() <= OUTSIDE:
        sentence += "; are the joints in another order? The arm's is " + ", ".join(names)
    yield sentence


def too_fast(
    demonstration: Demonstration, primitive: Primitive, limits: Limits, names: Sequence[str]
) -> Iterator[str]:
    """A sentence where the movement is faster than FAST times a velocity limit."""
    s = np.linspace(0, 1, 4 * primitive.basis_count + 1)
    speeds = np.abs(primitive.sample(s).velocities)
    steps = _steps(demonstration, primitive)
    fastest = np.maximum(speeds.max(axis=0), steps) / limits.velocities
    joint = int(fastest.argmax())
    if fastest[joint] > FAST:
        speed = fastest[joint] * limits.velocities[joint]
        yield (
            f"{names[joint]} moves at {speed:.3g} rad/s, {fastest[joint]:.0f} times its limit; "
            "check the units of positions and times"
        )


def jumps(demonstration: Demonstration, names: Sequence[str]) -> Iterator[str]:
    """Sentences for joints that turn by 2π from one sample to the next."""
    steps = np.diff(demonstration.positions, axis=0)
    for joint in np.flatnonzero(np.any(np.abs(np.abs(steps) - 2 * np.pi) < TURN_TOLERANCE, axis=0)):
        row = int(np.argmin(np.abs(np.abs(steps[:, joint]) - 2 * np.pi)))
        yield (
            f"{names[joint]} jumps by {steps[row, joint]:.3g} rad from sample {row} to {row + 1}; "
            "is the angle wrapped at ±π? Unwrap it, for the arm would turn once around"
        )


def garbled(demonstration: Demonstration) -> Iterator[str]:
    """A sentence where the bytes of the matrix make smooth columns when they are read in another way."""
    positions = np.ascontiguousarray(demonstration.positions)
    rough = _wandering(positions)
    if positions.shape[1] > 1 and _wandering(positions.reshape(positions.shape[::-1]).T) < GARBLED * rough:
        yield "the matrix is smooth when it is read column by column; it must be row-major, one sample after another"
    with np.errstate(all="ignore"):
        single = positions.view(np.float32).astype(float).reshape(-1, positions.shape[1])
        if np.isfinite(single).all() and _wandering(single) < GARBLED * rough:
            yield "the matrix is smooth when it is read as float32; it must be float64 (8 bytes a number)"


def gaps(demonstration: Demonstration, primitive: Primitive) -> Iterator[str]:
    """A sentence on stretches without samples that are longer than half the distance between two knots."""
    steps = np.diff(demonstration.times)
    knot = primitive.duration / (primitive.basis_count - 3)
    rows = np.flatnonzero(steps > max(GAP * float(np.median(steps)), knot / 2))
    if not len(rows):
        return
    longest = rows[np.argsort(-steps[rows], kind="stable")][:LISTED]
    times = demonstration.times - demonstration.times[0]
    listed = ", ".join(f"{steps[row]:.3g} s after {times[row]:.3g} s" for row in sorted(longest))
    rest = f" and {len(rows) - LISTED} more" if len(rows) > LISTED else ""
    yield f"samples are missing and the spline fills the gaps: {listed}{rest}"


def not_followed(demonstration: Demonstration, primitive: Primitive, names: Sequence[str]) -> Iterator[str]:
    """Sentences for joints whose spline passes beside the samples by more than their noise explains."""
    s = demonstration.phases
    beside = primitive.positions(s) - demonstration.positions
    # Noise averages out over half a knot interval, what the spline cannot follow does not.
    width = max(1, len(s) // (2 * (primitive.basis_count - 3)))
    sums = np.cumsum(np.pad(beside, ((1, 0), (0, 0))), axis=0)
    beside = np.abs(sums[width:] - sums[:-width]).max(axis=0) / width
    tolerance = np.maximum(_tolerance(primitive), 2 * _sample_noise(demonstration.positions))
    for joint in np.flatnonzero(beside > tolerance):
        yield (
            f"{names[joint]} cannot be followed: the spline passes {primitive.position_max[joint]:.2g} rad beside its "
            "samples; record the movement in parts, or look for jumps in it"
        )


def _tolerance(primitive: Primitive) -> np.ndarray:
    """Distance (J,), rad, that is worth a sentence."""
    positions = primitive.positions(np.linspace(0, 1, 1001))
    return np.maximum(PLACE_SHARE * np.ptp(positions, axis=0), PLACE_FLOOR)


def _sample_noise(positions: np.ndarray) -> np.ndarray:
    """Standard deviation (J,), rad, of what differs from sample to sample: from second differences, by their median."""
    return np.median(np.abs(np.diff(positions, n=2, axis=0)), axis=0) / 0.6745 / np.sqrt(6)


def _steps(demonstration: Demonstration, primitive: Primitive) -> np.ndarray:
    """Largest speed (J,), rad/s, between two samples, beyond their noise."""
    steps = np.diff(demonstration.times)
    moved = np.abs(np.diff(demonstration.positions, axis=0)) - 6 * primitive.noise_estimate
    return np.max(moved / np.maximum(steps, np.median(steps))[:, None], axis=0)


def _excess(positions: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """How far, rad, column i lies outside the range of joint j: (J, J)."""
    low, high = positions.min(axis=0)[:, None], positions.max(axis=0)[:, None]
    return np.maximum(np.maximum(high - ranges[:, 1], ranges[:, 0] - low), 0.0)


def _wandering(columns: np.ndarray) -> float:
    """Mean way that the columns (n, J) go from sample to sample, in units of their range."""
    ranges = np.ptp(columns, axis=0)
    ways = np.abs(np.diff(columns, axis=0)).sum(axis=0)
    return float(np.mean(ways[ranges > 0] / ranges[ranges > 0])) if np.any(ranges > 0) else 0.0
