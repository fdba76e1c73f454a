"""The quadratic programs of all joints in normalised time.

Rows belong to the spline space; a request changes right-hand sides only.
"""

import math
from dataclasses import dataclass

import numpy as np

from motion.limits import LED_BACK_BY, ROUNDING
from motion.primitive import Primitive
from motion.program.equalities import Equalities, Fixed, equalities_of
from motion.program.imitation import Imitated, imitated
from motion.program.limit_rows import LimitRows, limit_rows
from motion.program.space import MAX_ROWS, Hull, Space, make_hull, make_space
from motion.request import MotionRequest

PLACE_TIME = 0.5
"""s: where limits take something away, the arm comes back to where it was shown within about this time."""


@dataclass(frozen=True, slots=True)
class Precision:
    """How near to a limit a motion may come.

    refinement: knot intervals of the hull for each one of the motion. inside: rows are demanded this part of the
    limit's range inside of it, less where a control point can hardly move, as beside a fixed value on its limit: so
    what is solved to a tolerance, with few rows, keeps the limits.
    """

    refinement: int
    inside: float


USUAL = Precision(3, 1e-4)
"""With tight limits on everything the distance from the optimum without limits lies 1 % above the least in the median,
6 % at worst, which is half a percent and 3 % of the imitation error; finer hulls make larger programs."""

FINEST = Precision(16, 1e-6)
"""Tried before a request is refused."""


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """For each of J joints: minimise |z − z*|² subject to equalities and to limits on R control points.

    All in normalised time: quantity k is the k-th derivative with respect to s. duration: of the moving part, s.
    targets (J, m): of the equalities. origin (J, N + 2): the optimum x* without limits. In the units of the limit rows
    are room (J, 2, R), how far the origin's control points lie above their lower and below their upper limits, infinite
    where there is none or the equalities decide, and inside (J, R), how far inside of them a row is demanded. beyond
    (J, R): by how much the equalities hold a control point outside of its limits and their rounding. precise: rows are
    demanded so near to their limits that programs must be solved tightly.
    """

    space: Space
    hull: Hull
    duration: float
    imitated: Imitated
    equalities: Equalities
    targets: np.ndarray
    origin: np.ndarray
    limit_rows: LimitRows
    room: np.ndarray
    inside: np.ndarray
    beyond: np.ndarray
    precise: bool


def build(
    primitive: Primitive, request: MotionRequest, fixed: Fixed, final: np.ndarray, precision: Precision = USUAL
) -> Problem:
    """Return the problem of all joints.

    final (J, 2): the intervals that free final accelerations may use, rad/s². What is fixed has been checked. Raises
    InvalidMotion for too many fixed values, SolverFailed for values that depend on each other.
    """
    count = _count(primitive, request)
    part = imitated(primitive, *request.imitates, count)
    local = request.place_time is not None
    space = make_space(count, _stiffness(primitive, part, request.place_time or PLACE_TIME))
    refinement = min(precision.refinement, MAX_ROWS // (4 * count))
    hull = make_hull(space, refinement, fixed.touched)
    powers = request.moving_duration ** np.arange(4.0)
    values = fixed.values * powers[fixed.quantity, None]
    ranges = request.limits.ranges * powers[:, None]
    spread = ranges[..., 1] - ranges[..., 0]
    width = np.where(np.isfinite(spread), spread, 1.0)
    bounds = ranges[:, hull.quantity]
    _lead_back(hull, values[0], bounds)
    last = int(np.searchsorted(hull.quantity, 3)) - 1
    least, most = final.T * powers[2]
    free = np.isnan(values[-1])
    narrow = free & (most - least <= 4 * precision.inside * width[:, 2])
    values[-1, narrow] = (least[narrow] + most[narrow]) / 2
    free &= ~narrow
    bounds[free, last] = np.stack([least[free], most[free]], axis=1)
    equalities, targets = equalities_of(space, fixed, values, local)
    start = np.concatenate([space.whitened(part.weights), values[:2].T], axis=1)
    if local:
        start[:, :-2] += (values[:2].T - part.start) @ space.drift
    origin = equalities.adapted(start, targets)
    rows = limit_rows(equalities, hull)
    at = origin @ hull.rows.T
    room = np.stack([at - bounds[..., 0], bounds[..., 1] - at], axis=1)
    width = width[:, hull.quantity]
    beyond = np.where(rows.decided, -room.min(axis=1) - ROUNDING * width, -1.0)
    room *= rows.scales[:, None]
    room.transpose(0, 2, 1)[rows.decided] = np.inf
    inside = precision.inside * width * rows.least
    precise = precision.inside < USUAL.inside
    return Problem(
        space, hull, request.moving_duration, part, equalities, targets, origin, rows, room, inside, beyond, precise
    )


def _count(primitive: Primitive, request: MotionRequest) -> int:
    """How many functions: the demonstration's, on finer knots where waypoints lie closer than two of its intervals."""
    times = np.sort([0.0, request.moving_duration, *(w.time_from_start for w in request.waypoints)])
    intervals, apart = primitive.basis_count - 3, np.diff(times).min() / request.moving_duration
    finer = max(1, math.ceil(2 / (apart * intervals))) if request.waypoints else 1
    return intervals * finer + 3


def _stiffness(primitive: Primitive, part: Imitated, place_time: float) -> float:
    """κ = T_d/t_c. For a part of a demonstration the nearest of a few, so that their metrics are made once."""
    whole = primitive.duration / place_time
    steps = round(2 * math.log2(primitive.duration / part.duration))
    return whole * 2 ** (-steps / 2)


def _lead_back(hull: Hull, start: np.ndarray, bounds: np.ndarray) -> None:
    """Widen the position limits, in place, of a joint that begins outside of them, up to a part of its way."""
    outside = (start < bounds[:, 0, 0]) | (start > bounds[:, 0, 1])
    if outside.any():
        early = np.flatnonzero((hull.quantity == 0) & (hull.ceases <= LED_BACK_BY))
        bounds[:, early, 0] = np.minimum(bounds[:, early, 0], start[:, None])
        bounds[:, early, 1] = np.maximum(bounds[:, early, 1], start[:, None])
