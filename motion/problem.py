"""One joint's quadratic program in normalised time (design 1.1, 1.5, 1.6).

Rows belong to the basis; a request changes right-hand sides only. Equalities fix what the request fixes,
limits are demanded on the grid a little inside their true place.
"""

from dataclasses import dataclass

import numpy as np

from motion.basis import INTERVALS, Grid
from motion.errors import LimitExceeded
from motion.limits import QUANTITIES
from motion.request import MotionRequest

BAND = 1e-3
"""Rows are demanded at this part of half the limit's range inside the limit (ε of design 1.6)."""

TAPER = 0.1
"""Distance in s from a fixed boundary value within which the band grows to its full width."""

LED_BACK = 0.2
"""A start outside its limits has to be inside from this s on."""

POSITION_OUTSIDE = 0.02
"""A start may lie outside its position limits by this much, rad: an arm that was pushed."""

TOUCH = 1e-6
"""Beside a boundary value on its limit, certified means within this part of the limit's range."""

FIXED_TOLERANCE = 1e-9
"""Values fixed by the request may pass their limit by this part of its range: rounding."""


@dataclass(frozen=True, slots=True)
class Fixed:
    """A value fixed by the request: quantity 0 position, 1 velocity, 2 acceleration, at s."""

    quantity: int
    s: float
    value: float


@dataclass(frozen=True, slots=True, eq=False)
class JointProblem:
    """Minimise |z − z_d|² subject to `equalities` z = `targets` and the limits on the grid.

    Arrays over quantities and grid samples have shape (4, M). Value = offsets + rows·z / T^order in physical
    units. `lower`, `upper`: the true limits, infinite where there are none or the motion is over;
    `lower_band`, `upper_band`: how far inside them rows are demanded; `half_range` (4, 1) their scale.
    """

    joint: int
    duration: float
    equalities: np.ndarray
    targets: np.ndarray
    offsets: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    lower_band: np.ndarray
    upper_band: np.ndarray
    half_range: np.ndarray
    last: int

    def scale(self, orders: int = 4) -> np.ndarray:
        """T^order (orders, 1) for position, velocity, acceleration, …"""
        return self.duration ** np.arange(float(orders))[:, None]

    def values(self, grid: Grid, z: np.ndarray) -> np.ndarray:
        """Position, velocity, acceleration and jerk (4, M) of the weights z (N,) on the grid."""
        rows = grid.rows[:4]
        out = (rows.reshape(-1, rows.shape[2]) @ z).reshape(4, -1)
        out /= self.scale()
        out += self.offsets
        return out


def fixed_values(request: MotionRequest, joint: int, final_acceleration: float) -> list[Fixed]:
    """What the request fixes of one joint, the start first. A NaN final acceleration is free.

    With a rest fraction ρ the moving part ends at s = 1−ρ, from where a straight line leads to the goal
    (design 1.9).
    """
    start, goal, duration = request.start, request.goal, request.duration
    end = request.moving_fraction
    goal_velocity = goal.velocities[joint]
    end_position = goal.positions[joint] - (1 - end) * duration * goal_velocity
    fixed = [
        Fixed(0, 0.0, start.positions[joint]),
        Fixed(1, 0.0, start.velocities[joint]),
        Fixed(2, 0.0, start.accelerations[joint]),
    ]
    for waypoint in request.waypoints:
        s = waypoint.time_from_start / duration
        fixed += [Fixed(0, s, waypoint.positions[joint]), Fixed(1, s, waypoint.velocities[joint])]
    fixed += [Fixed(0, end, end_position), Fixed(1, end, goal_velocity), Fixed(2, end, final_acceleration)]
    return [Fixed(f.quantity, f.s, float(f.value)) for f in fixed if not np.isnan(f.value)]


def check_fixed(fixed: list[Fixed], ranges: np.ndarray, joint: int) -> None:
    """Raises LimitExceeded for a fixed value outside its range; `ranges` (4, 2) as of Limits.joint."""
    for f in fixed:
        low, high = ranges[f.quantity]
        tolerance = FIXED_TOLERANCE * _half(low, high) * 2
        if f.s == 0:
            tolerance = _start_tolerance(f.quantity, low, high)
        if not low - tolerance <= f.value <= high + tolerance:
            bound = low if f.value < low else high
            raise LimitExceeded(joint, QUANTITIES[f.quantity], f.value, float(bound))


def build(
    grid: Grid,
    request: MotionRequest,
    joint: int,
    final_acceleration: np.ndarray,
) -> JointProblem:
    """The problem of one joint. `final_acceleration` (2,) is the interval that the end may use (design 1.9).

    Raises LimitExceeded for a fixed value outside the limits.
    """
    ranges = request.limits.joint(joint)
    low, high = final_acceleration
    # A narrower interval than the bands of its row is a value.
    narrow = high - low <= 4 * BAND * _half(*ranges[2])
    fixed = fixed_values(request, joint, (low + high) / 2 if narrow else np.nan)
    check_fixed(fixed, ranges, joint)
    last = round(request.moving_fraction * INTERVALS)
    lower, upper = _bounds(grid, fixed, ranges, last)
    half = np.array([[_half(*r)] for r in ranges])
    lower_band, upper_band = _bands(grid, fixed, ranges, half)
    if not narrow:
        lower[2, last], upper[2, last] = max(lower[2, last], low), min(upper[2, last], high)
        for band in (lower_band, upper_band):
            band[2, last] = min(band[2, last], (high - low) / 4)
    equalities, targets = _equalities(grid, request, joint, fixed)
    return JointProblem(
        joint=joint,
        duration=request.duration,
        equalities=equalities,
        targets=targets,
        offsets=_offsets(grid, request, joint),
        lower=lower,
        upper=upper,
        lower_band=lower_band,
        upper_band=upper_band,
        half_range=half,
        last=last,
    )


def _offsets(grid: Grid, request: MotionRequest, joint: int) -> np.ndarray:
    """The motion with all weights zero: constant velocity from the start."""
    p0, v0 = request.start.positions[joint], request.start.velocities[joint]
    offsets = np.zeros((4, len(grid.s)))
    offsets[0] = p0 + grid.s * request.duration * v0
    offsets[1] = v0
    return offsets


def _equalities(grid: Grid, request: MotionRequest, joint: int, fixed: list[Fixed]) -> tuple[np.ndarray, np.ndarray]:
    """Rows (m, N) on z and targets (m,) for all that is fixed; the start's state is met by construction."""
    p0, v0 = request.start.positions[joint], request.start.velocities[joint]
    duration = request.duration
    rows, targets = [], []
    for f in fixed:
        if f.s == 0 and f.quantity < 2:
            continue
        offset = (p0 + f.s * duration * v0, v0, 0.0)[f.quantity]
        rows.append(_row(grid, f.quantity, f.s))
        targets.append((f.value - offset) * duration**f.quantity)
    return np.array(rows), np.array(targets)


def _row(grid: Grid, quantity: int, s: float) -> np.ndarray:
    """The row (N,) of one quantity on z, from the grid where s lies on it."""
    index = round(s * INTERVALS)
    if index == s * INTERVALS:
        return grid.rows[quantity, index]
    return grid.rows_at(np.array([s]), quantity - 2)[0]


def _bounds(grid: Grid, fixed: list[Fixed], ranges: np.ndarray, last: int) -> tuple[np.ndarray, np.ndarray]:
    """True limits (4, M) each: none after the last sample, wider at a start that lies outside."""
    lower = np.repeat(ranges[:, :1], len(grid.s), axis=1)
    upper = np.repeat(ranges[:, 1:], len(grid.s), axis=1)
    back = round(LED_BACK * INTERVALS)
    for f in fixed:
        if f.s == 0:
            lower[f.quantity, :back] = min(lower[f.quantity, 0], f.value)
            upper[f.quantity, :back] = max(upper[f.quantity, 0], f.value)
    lower[:, last + 1 :], upper[:, last + 1 :] = -np.inf, np.inf
    return lower, upper


def _bands(grid: Grid, fixed: list[Fixed], ranges: np.ndarray, half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """μ(s) = min(εr, m + εr(d/0.1)³) for the lower and the upper limits, (4, M) each (design 1.6)."""
    lower = np.repeat(BAND * half, len(grid.s), axis=1)
    upper = lower.copy()
    for f in fixed:
        full = BAND * half[f.quantity, 0]
        slack = f.value - ranges[f.quantity, 0], ranges[f.quantity, 1] - f.value
        for band, m in zip((lower, upper), slack, strict=True):
            if m < full:
                taper = max(m, 0.0) + full * (np.abs(grid.s - f.s) / TAPER) ** 3
                np.minimum(band[f.quantity], taper, out=band[f.quantity])
    return lower, upper


def _half(low: float, high: float) -> float:
    """Half a limit's range; 1 where it is unbounded."""
    return (high - low) / 2 if np.isfinite(high - low) else 1.0


def _start_tolerance(quantity: int, low: float, high: float) -> float:
    """How far outside its range a start may lie: a pushed arm, or what the certificate lets a plan touch."""
    return POSITION_OUTSIDE if quantity == 0 else 2 * TOUCH * 2 * _half(low, high)
