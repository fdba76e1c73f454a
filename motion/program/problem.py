"""The quadratic programs of all joints in normalised time.

Rows belong to the spline space; a request changes right-hand sides only.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from motion.limits import RETURN_BY, ROUNDING, SIGNS
from motion.primitive import Primitive
from motion.program.contradiction import check_means
from motion.program.equalities import Equalities, Fixed, equalities_of
from motion.program.imitation import Imitated, imitated, place_weights
from motion.program.limit_rows import KINDS, LimitRows, limit_rows
from motion.program.space import MAX_ROWS, PLACE_TIME, Hull, Space, make_hull, make_space
from motion.request import MotionRequest


@dataclass(frozen=True, slots=True)
class Precision:
    """How closely a motion may approach a limit, and how finely it is represented.

    refinement: knot intervals of the hull for each one of the motion. inside: rows are tightened by this part of the
    limit's range, so that a solution of finite tolerance keeps the limits; by less for control points that can hardly
    move, as beside a prescribed value on its limit. thinning: knot intervals of the demonstration for each one of the
    motion. imitates: minimise the distance from the demonstration; otherwise minimise the acceleration.
    """

    refinement: int
    inside: float
    thinning: int = 1
    imitates: bool = True


USUAL = Precision(3, 1e-4)
"""With tight limits on all quantities the distance from the optimum without limits is 1 % above the least in the
median, 6 % at worst. That is 0.5 % and 3 % of the imitation error. Finer hulls make larger programs."""

FINEST = Precision(16, 1e-6)
"""Tried before a request is refused as infeasible."""

FEWER_FUNCTIONS = tuple(replace(USUAL, thinning=each) for each in (2, 4, 8))
"""Tried if the usual precision takes too long; takes a hundredth of the time. A motion that runs along limits
everywhere cannot follow all details of the demonstration: docs/derivations.md quantifies the loss."""

LEAST_ACCELERATION = replace(USUAL, imitates=False)
"""Decides whether a request is feasible. In a duration far below its own a demonstration violates limits everywhere;
the motion of least acceleration needs a tenth of the rows."""

MANY_FUNCTIONS = 70
"""Number of functions of a demonstration beyond which the effort of a plan grows with it."""

MIN_FUNCTIONS = 20
"""Least number of functions to which demonstrations are thinned."""


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """For each of J joints: minimise |z − z*|² subject to equalities and to limits on R control points.

    All in normalised time: quantity k is the k-th derivative with respect to s. duration: of the moving part, s.
    targets (J, m): of the equalities. origin (J, N + 2): the optimum x* without limits. over (J, 2, R): violation of
    the lower and upper limits by the origin, in units of the rows; −inf without a limit; for control points that the
    equalities determine, the violation beyond rounding. inside (J, 2, KINDS): tightening of the bounds of each kind, in
    units of the rows. precise: the tightening is so small that programs need the tight solver tolerance.
    """

    space: Space
    hull: Hull
    duration: float
    imitated: Imitated
    equalities: Equalities
    targets: np.ndarray
    origin: np.ndarray
    limit_rows: LimitRows
    over: np.ndarray
    inside: np.ndarray
    precise: bool


def build(
    primitive: Primitive, request: MotionRequest, fixed: Fixed, final: np.ndarray, precision: Precision = USUAL
) -> Problem:
    """Return the problem of all joints.

    final (J, 2): intervals of the free final accelerations, rad/s². The prescribed values must lie inside their limits.
    Raises InfeasibleRows if the limits contradict the prescribed values, InvalidMotion for too many of these,
    SolverFailed for linearly dependent ones.
    """
    check_means(fixed, request.moving_duration, request.limits)
    count = _count(primitive, request, precision.thinning)
    part = imitated(primitive, *request.imitates, count)
    stiffness = _stiffness(primitive, part, request.place_time or PLACE_TIME)
    space = make_space(count, stiffness)
    own = tuple(make_space(count, stiffness, weights) for weights in place_weights(primitive, *request.imitates))
    local = precision.imitates and (bool(own) or request.place_time is not None)
    refinement = min(precision.refinement, MAX_ROWS // (4 * count))
    hull = make_hull(space, refinement, fixed.touched)
    powers = request.moving_duration**_ORDERS
    values = fixed.values * powers[fixed.quantity, None]
    width, final = request.limits.width * powers, final * powers[2]
    _fix_narrow(values[-1], final, 4 * precision.inside * width[:, 2])
    equalities, targets = equalities_of(space, fixed, values, local, own)
    start = np.empty((len(final), count + 2))
    start[:, :-2] = space.whitened(part.weights) if precision.imitates else 0.0
    start[:, -2:] = values[:2].T
    if local:
        beside = values[:2].T - part.start
        drifts = [metric.drift for metric in own] or [space.drift] * len(start)
        led = np.array([each @ drift for each, drift in zip(beside, drifts, strict=True)])
        start[:, :-2] += equalities.steps(range(len(start)), led)
    origin = equalities.adapted(start, targets)
    rows = limit_rows(equalities, hull)
    limits = np.empty((len(final), 2, KINDS))
    limits[..., :4] = request.limits.signed * powers
    limits[..., 4] = SIGNS * final
    limits[..., 5:] = limits[..., :4] + (ROUNDING * width)[:, None]
    over = SIGNS[:, None] * (origin @ hull.rows.T)[:, None]
    over -= limits.take(rows.bound)
    _lead_back(hull, over, 2 * ROUNDING * width[:, :1])
    over *= rows.scales[:, None]
    inside = np.zeros(limits.shape)
    inside[..., :4] = (precision.inside * width * rows.least)[:, None]
    inside[..., 4] = inside[..., 2]
    return Problem(
        space=space,
        hull=hull,
        duration=request.moving_duration,
        imitated=part,
        equalities=equalities,
        targets=targets,
        origin=origin,
        limit_rows=rows,
        over=over,
        inside=inside,
        precise=precision.inside < USUAL.inside,
    )


_ORDERS = np.arange(4.0)


def _fix_narrow(last: np.ndarray, final: np.ndarray, narrow: np.ndarray) -> None:
    """Prescribe, in place, free final accelerations (J,) whose interval `final` (J, 2) is too narrow to matter."""
    chosen = final[:, 1] - final[:, 0] <= narrow
    if chosen.any():
        chosen &= np.isnan(last)
        last[chosen] = final[chosen].mean(axis=1)


def thinned(count: int, thinning: int) -> int:
    """Number of functions after `count` functions are thinned."""
    return math.ceil((count - 3) / thinning) + 3


def _count(primitive: Primitive, request: MotionRequest, thinning: int) -> int:
    """Number of functions: the demonstration's, or more if waypoints are closer than two of its knot intervals."""
    own = thinned(primitive.basis_count, thinning)
    if not request.waypoints:
        return own
    times = np.sort([0.0, request.moving_duration, *(w.time_from_start for w in request.waypoints)])
    intervals, apart = own - 3, np.diff(times).min() / request.moving_duration
    return intervals * max(1, math.ceil(2 / (apart * intervals))) + 3


def _stiffness(primitive: Primitive, part: Imitated, place_time: float) -> float:
    """κ = T_d/t_c; for a part of a demonstration, rounded to one of a few values, so that few metrics are built."""
    whole = primitive.duration / place_time
    steps = round(2 * math.log2(primitive.duration / part.duration))
    return whole * 2 ** (-steps / 2)


def _lead_back(hull: Hull, over: np.ndarray, rounding: np.ndarray) -> None:
    """Widen the position limits, in place, for the first part of a motion that begins outside of them.

    over (J, 2, R): violations by the control points; the first is the start. rounding (J, 1): added to the widening.
    """
    wider = over[:, :, 0] + rounding
    if (wider > 0).any():
        early = np.flatnonzero((hull.quantity == 0) & (hull.ceases <= RETURN_BY))
        over[:, :, early] -= np.maximum(wider, 0.0)[:, :, None]
