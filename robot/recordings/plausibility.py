"""Plausibility of a recording for this arm: warnings with a likely cause."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import scipy

from motion import splines
from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.primitive import Primitive

FAST = 10.0
"""Implausible speed, in units of the velocity limit."""

ORDERS = 1, 2, 3
"""Orders of the derivatives of position that have limits: velocity, acceleration, jerk."""

OUTSIDE = 0.02
"""Distance outside its range, rad, that a joint may have by calibration or pushing."""

TURN_TOLERANCE = 0.5
"""Largest difference, rad, of a wrapped angle's jump from a full turn."""

GARBLED = 0.2
"""A matrix is column-major if reading it by columns reduces its largest steps below this fraction."""

LEAST, MOST = 1e-9, 1e4
"""Plausible magnitudes of a joint position, rad; a sixth of all random float32 numbers has them."""

NEARLY_ALL = 0.9


def outside(demonstration: Demonstration, limits: Limits, names: Sequence[str]) -> Iterator[str]:
    """Yield a warning if samples are outside position ranges, with a likely cause."""
    excess = _excess(demonstration.positions, limits.positions)
    joint = int(np.argmax(np.diagonal(excess)))
    if excess[joint, joint] <= OUTSIDE:
        return
    low, high = limits.positions[joint].tolist()
    column = demonstration.positions[:, joint]
    value = float(column[int(np.argmax(np.maximum(column - high, low - column)))])
    sentence = f"{names[joint]} reaches {value:.4g} rad, outside its range of {low:.4g} to {high:.4g} rad"
    order = scipy.optimize.linear_sum_assignment(excess)[1]
    degrees = _excess(np.radians(demonstration.positions), limits.positions)
    if abs(value) > 2 * np.pi + OUTSIDE and np.diagonal(degrees).max() <= OUTSIDE:
        sentence += "; are the positions in degrees?"
    elif excess[np.arange(len(order)), order].max() <= OUTSIDE:
        sentence += "; are the joints in another order? The arm's is " + ", ".join(names)
    yield sentence


def too_fast(demonstration: Demonstration, primitive: Primitive, limits: Limits, names: Sequence[str]) -> Iterator[str]:
    """Yield a warning if the movement is faster than FAST times a velocity limit."""
    s = np.linspace(0, 1, 4 * primitive.basis_count + 1)
    speeds = np.abs(primitive.sample(s).velocities)
    steps = np.diff(demonstration.times)
    moved = np.abs(np.diff(demonstration.positions, axis=0)) - 6 * primitive.noise_estimate
    between = np.max(moved / np.maximum(steps, np.median(steps))[:, None], axis=0)
    fastest = np.maximum(speeds.max(axis=0), between)
    shares = fastest / limits.velocities
    joint = int(shares.argmax())
    if shares[joint] > FAST:
        yield (
            f"{names[joint]} moves at {fastest[joint]:.3g} rad/s, {shares[joint]:.3g} times its limit; "
            "check the units of positions and times"
        )


def beyond_limits(primitive: Primitive, limits: Limits, names: Sequence[str]) -> Iterator[str]:
    """Yield a warning if the movement exceeds limits in its own duration, with the shortest duration that does not.

    A movement that is `too_fast` gets no warning here: its units are wrong.
    """
    s = np.linspace(0, 1, 4 * primitive.basis_count + 1)
    peaks = [np.abs(splines.derivative(primitive.control_points, s, order)).max(axis=0) for order in ORDERS]
    bounds = limits.velocities, limits.accelerations, limits.jerks
    durations = [(peak / bound) ** (1 / n) for n, peak, bound in zip(ORDERS, peaks, bounds, strict=True)]
    shortest, duration = float(np.max(durations)), primitive.duration
    if shortest <= duration or durations[0].max() > FAST * duration:
        return
    order, joint = divmod(int(np.argmax(durations)), len(names))
    share = (shortest / duration) ** ORDERS[order]
    yield (
        f"in {duration:.4g} s the movement passes limits of the arm ({names[joint]} reaches {share:.3g} times its "
        f"{('velocity', 'acceleration', 'jerk')[order]} limit), and a motion leaves its places there; with a duration "
        f"of {math.ceil(100 * shortest) / 100:g} s or more it keeps them"
    )


def jumps(demonstration: Demonstration, names: Sequence[str]) -> Iterator[str]:
    """Yield a warning for each joint that jumps by 2π from one sample to the next."""
    steps = np.diff(demonstration.positions, axis=0)
    distances = np.abs(np.abs(steps) - 2 * np.pi)
    for joint in np.flatnonzero(np.any(distances < TURN_TOLERANCE, axis=0)).tolist():
        row = int(distances[:, joint].argmin())
        yield (
            f"{names[joint]} jumps by {steps[row, joint]:.3g} rad from sample {row} to {row + 1}; "
            "is the angle wrapped at ±π? Unwrap it, for the arm would turn once around"
        )


def garbled(demonstration: Demonstration) -> Iterator[str]:
    """Yield a warning if the matrix's bytes make more sense in another layout or type."""
    positions = np.ascontiguousarray(demonstration.positions)
    columns = positions.reshape(positions.shape[::-1]).T
    if positions.shape[1] > 1 and _largest_step(columns) < GARBLED * _largest_step(positions):
        yield "the matrix is smooth when it is read column by column; it must be row-major, one sample after another"
    # Read as float32, the lower halves of float64 are random: of any magnitude, or NaN.
    halves = np.abs(positions.view(np.float32).reshape(-1, 2))
    sizes = halves[halves > 0]
    if np.count_nonzero(halves[:, 0]) > len(halves) / 2 and np.mean((sizes > LEAST) & (sizes < MOST)) > NEARLY_ALL:
        yield "the matrix makes sense when it is read as float32; it must be float64 (8 bytes a number)"


def _excess(positions: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """Return the distance (J, J), rad, of column i from the range of joint j."""
    low, high = positions.min(axis=0)[:, None], positions.max(axis=0)[:, None]
    return np.maximum(np.maximum(high - ranges[:, 1], ranges[:, 0] - low), 0.0)


def _largest_step(columns: np.ndarray) -> float:
    """Return the mean over columns of the largest step from sample to sample, in units of the column's range."""
    ranges = np.ptp(columns, axis=0)
    steps = np.abs(np.diff(columns, axis=0)).max(axis=0)
    return float(np.mean(steps[ranges > 0] / ranges[ranges > 0])) if np.any(ranges > 0) else 0.0
