"""The quadratic programs of all joints in normalised time (design 1.1, 1.5, 1.6).

Rows belong to the basis; a request changes right-hand sides only. Equalities fix what the request fixes,
limits are demanded on the grid a little inside their true place.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from motion.basis import INTERVALS, Grid
from motion.errors import LimitExceeded, SolverFailed
from motion.limits import QUANTITIES, Limits
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


@dataclass(frozen=True, slots=True, eq=False)
class Fixed:
    """F values fixed by the request, the start first, of J joints.

    quantity (F,): 0 position, 1 velocity, 2 acceleration; s (F,): where; values (F, J): NaN where it is free.
    """

    quantity: np.ndarray
    s: np.ndarray
    values: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Equalities:
    """What a joint's fixed values demand of z: `rows` (m, N), an orthonormal basis `span` (N, m) of them, and
    `coordinates` (m, m), which leads from targets to the coordinates in that basis."""

    rows: np.ndarray
    span: np.ndarray
    coordinates: np.ndarray

    def nearest(self, z: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """The point nearest to z that meets the equalities; twice, so that they hold to rounding."""
        wanted = self.coordinates @ targets
        for _ in range(2):
            z = z + self.span @ (wanted - z @ self.span)
        return z


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """For each of J joints: minimise |z − z_d|² subject to equalities z = targets and the limits on the grid.

    Arrays over joints, quantities and grid samples have shape (J, 4, M). Value = offset + rows·z / T^order in
    physical units, the offset being the motion at the start's constant velocity. `lower`, `upper`: the true
    limits, infinite where there are none or the motion is over; `lower_band`, `upper_band`: how far inside
    them rows are demanded; `half_range` (J, 4) their scale. `limited`: which rows there are; the solver takes
    out what the equalities alone decide. `last`: the index of the last sample in motion.
    """

    duration: float
    last: int
    start_positions: np.ndarray
    start_velocities: np.ndarray
    equalities: tuple[Equalities, ...]
    targets: tuple[np.ndarray, ...]
    lower: np.ndarray
    upper: np.ndarray
    lower_band: np.ndarray
    upper_band: np.ndarray
    half_range: np.ndarray
    limited: np.ndarray

    def values(self, grid: Grid, z: np.ndarray, joints: list[int]) -> np.ndarray:
        """Position, velocity, acceleration and jerk (n, 4, M) on the grid of the weights z (n, N) of n joints."""
        out = (z @ grid.flat_rows.T).reshape(len(z), 4, -1)
        out /= self.duration ** np.arange(4.0)[:, None]
        velocities = self.start_velocities[joints][:, None]
        out[:, 0] += self.start_positions[joints][:, None] + grid.s * (self.duration * velocities)
        out[:, 1] += velocities
        return out

    def offset(self, joint: int, quantity: np.ndarray, s: np.ndarray) -> np.ndarray:
        """The constant part (n,) of one joint's quantities (n,) at s (n,)."""
        position, velocity = self.start_positions[joint], self.start_velocities[joint]
        moved = position + s * (self.duration * velocity)
        return np.where(quantity == 0, moved, np.where(quantity == 1, velocity, 0.0))


def limit_ranges(limits: Limits) -> np.ndarray:
    """Lowest and highest value (J, 4, 2) of each joint and quantity."""
    ranges = np.empty((limits.joint_count, 4, 2))
    ranges[:, 0] = limits.positions
    for k, largest in enumerate((limits.velocities, limits.accelerations, limits.jerks), start=1):
        ranges[:, k, 0], ranges[:, k, 1] = -largest, largest
    return ranges


def fixed_values(request: MotionRequest, final_accelerations: np.ndarray) -> Fixed:
    """What the request fixes. A NaN among the final accelerations (J,) is free.

    With a rest fraction ρ the moving part ends at s = 1−ρ, from where a straight line leads to the goal
    (design 1.9).
    """
    start, goal, duration = request.start, request.goal, request.duration
    end = request.moving_fraction
    fixed = [(0, 0.0, start.positions), (1, 0.0, start.velocities), (2, 0.0, start.accelerations)]
    for waypoint in request.waypoints:
        s = waypoint.time_from_start / duration
        fixed += [(0, s, waypoint.positions), (1, s, waypoint.velocities)]
    end_positions = goal.positions - (1 - end) * duration * goal.velocities
    fixed += [(0, end, end_positions), (1, end, goal.velocities), (2, end, final_accelerations)]
    quantity, s, values = zip(*fixed, strict=True)
    return Fixed(np.array(quantity), np.array(s), np.array(values))


def check_fixed(request: MotionRequest) -> None:
    """Raises LimitExceeded for the first joint's first fixed value outside its range."""
    fixed = fixed_values(request, request.final_accelerations())
    ranges = limit_ranges(request.limits)[:, fixed.quantity]
    width = 2 * _half(ranges)
    tolerance = np.where(fixed.s == 0, 2 * TOUCH * width, FIXED_TOLERANCE * width)
    tolerance[:, (fixed.s == 0) & (fixed.quantity == 0)] = POSITION_OUTSIDE
    values = fixed.values.T
    outside = (values < ranges[:, :, 0] - tolerance) | (values > ranges[:, :, 1] + tolerance)
    if outside.any():
        joint, k = np.unravel_index(outside.argmax(), outside.shape)
        value, (low, high) = values[joint, k], ranges[joint, k]
        bound = low if value < low else high
        raise LimitExceeded(int(joint), QUANTITIES[fixed.quantity[k]], float(value), float(bound))


def build(grid: Grid, request: MotionRequest, final_accelerations: np.ndarray) -> Problem:
    """The problem of all joints. `final_accelerations` (J, 2) are the intervals that the end may use (design 1.9).

    What is fixed has been checked. Raises SolverFailed for fixed values that depend on each other.
    """
    ranges = limit_ranges(request.limits)
    half = _half(ranges)
    low, high = final_accelerations.T
    # A narrower interval than the bands of its row is a value.
    narrow = high - low <= 4 * BAND * half[:, 2]
    middle = np.full(len(low), np.nan)
    middle[narrow] = (low[narrow] + high[narrow]) / 2
    fixed = fixed_values(request, middle)
    last = round(request.moving_fraction * INTERVALS)
    lower, upper = _bounds(grid, fixed, ranges, last)
    lower_band, upper_band = _bands(grid, fixed, ranges, half)
    for joint in np.flatnonzero(~narrow):
        here = joint, 2, last
        lower[here], upper[here] = max(lower[here], low[joint]), min(upper[here], high[joint])
        for band in (lower_band, upper_band):
            band[here] = min(band[here], (high[joint] - low[joint]) / 4)
    equalities, targets = _equalities(grid, request, fixed)
    return Problem(
        duration=request.duration,
        last=last,
        start_positions=request.start.positions,
        start_velocities=request.start.velocities,
        equalities=equalities,
        targets=targets,
        lower=lower,
        upper=upper,
        lower_band=lower_band,
        upper_band=upper_band,
        half_range=half,
        limited=np.isfinite(lower) | np.isfinite(upper),
    )


def _equalities(
    grid: Grid, request: MotionRequest, fixed: Fixed
) -> tuple[tuple[Equalities, ...], tuple[np.ndarray, ...]]:
    """Equalities and targets (m,) of each joint; the start's position and velocity are met by construction."""
    p0, v0, duration = request.start.positions, request.start.velocities, request.duration
    quantity, s = fixed.quantity[2:], fixed.s[2:]
    offsets = np.zeros((3, len(s), request.joint_count))
    offsets[0] = p0 + s[:, None] * duration * v0
    offsets[1] = v0
    wanted = fixed.values[2:] - offsets[quantity, np.arange(len(s))]
    wanted *= duration ** quantity[:, None].astype(float)
    equalities, targets = [], []
    for joint, column in enumerate(wanted.T):
        given = ~np.isnan(column)
        equality = _factored(grid, tuple(zip(quantity[given].tolist(), s[given].tolist(), strict=True)))
        if equality is None:
            raise SolverFailed(joint, "the fixed values depend on each other")
        equalities.append(equality)
        targets.append(column[given])
    return tuple(equalities), tuple(targets)


@lru_cache(maxsize=128)
def _factored(grid: Grid, places: tuple[tuple[int, float], ...]) -> Equalities | None:
    """The equalities that fix the quantities at the places s; None if they depend on each other."""
    rows = np.array([_row(grid, quantity, s) for quantity, s in places])
    norms = np.linalg.norm(rows, axis=1)
    span, r = np.linalg.qr((rows / norms[:, None]).T)
    if np.abs(np.diag(r)).min() < 1e-10:
        return None
    return Equalities(rows, span, np.linalg.inv(r.T) / norms)


def _row(grid: Grid, quantity: int, s: float) -> np.ndarray:
    """The row (N,) of one quantity on z, from the grid where s lies on it."""
    index = round(s * INTERVALS)
    if index == s * INTERVALS:
        return grid.rows[quantity, index]
    return grid.rows_at(np.array([s]), quantity - 2)[0]


def _bounds(grid: Grid, fixed: Fixed, ranges: np.ndarray, last: int) -> tuple[np.ndarray, np.ndarray]:
    """True limits (J, 4, M) each: none after the last sample, wider at a start that lies outside."""
    lower = np.repeat(ranges[:, :, :1], len(grid.s), axis=2)
    upper = np.repeat(ranges[:, :, 1:], len(grid.s), axis=2)
    back = round(LED_BACK * INTERVALS)
    for k, values in enumerate(fixed.values[:3]):
        for joint in np.flatnonzero((values < ranges[:, k, 0]) | (values > ranges[:, k, 1])):
            lower[joint, k, :back] = min(lower[joint, k, 0], values[joint])
            upper[joint, k, :back] = max(upper[joint, k, 0], values[joint])
    lower[:, :, last + 1 :], upper[:, :, last + 1 :] = -np.inf, np.inf
    return lower, upper


def _bands(grid: Grid, fixed: Fixed, ranges: np.ndarray, half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """μ(s) = min(εr, m + εr(d/0.1)³) for the lower and the upper limits, (J, 4, M) each (design 1.6)."""
    full = BAND * half
    lower = np.repeat(full[:, :, None], len(grid.s), axis=2)
    upper = lower.copy()
    here = full[:, fixed.quantity].T
    for band, slack in (
        (lower, fixed.values - ranges[:, fixed.quantity, 0].T),
        (upper, ranges[:, fixed.quantity, 1].T - fixed.values),
    ):
        for k, joint in zip(*np.nonzero(slack < here), strict=True):
            taper = max(slack[k, joint], 0.0) + here[k, joint] * (np.abs(grid.s - fixed.s[k]) / TAPER) ** 3
            row = band[joint, fixed.quantity[k]]
            np.minimum(row, taper, out=row)
    return lower, upper


def _half(ranges: np.ndarray) -> np.ndarray:
    """Half of each limit's range (…, 2); 1 where it is unbounded."""
    half = (ranges[..., 1] - ranges[..., 0]) / 2
    return np.where(np.isfinite(half), half, 1.0)
