"""The terminal set: final accelerations, and final velocities, that leave room for the stop after the hit."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from motion.braking import STOP_ROUNDING, UNLIMITED, Floats, fastest_stop
from motion.errors import CannotStop
from motion.limits import Limits
from motion.request import Boundary, MotionRequest

ON_LIMIT = 1e-9
"""A velocity lies on its limit if its distance is below this part of the limit."""

TRIED = 257
"""Number of velocities in the first round of a search whose feasible interval need not contain zero."""

_TRIED = 17
"""Number of values in each other round of a search."""

_ROUNDS = 5
"""Rounds after the first. Each narrows the interval by a factor of `_TRIED` − 1, in all to a millionth."""


def arriving(request: MotionRequest) -> np.ndarray:
    """Return the interval (J, 2) of each joint's acceleration at the end of the moving part.

    Position limits of the stop are not considered here.
    """
    each = zip(*(values.tolist() for values in _arrival(request)), strict=True)
    return np.array([_interval(request.tail == "stop", Floats, *joint) for joint in each])


def _arrival(request: MotionRequest) -> tuple[np.ndarray, ...]:
    limits = request.limits
    bounds = limits.velocities, limits.accelerations, limits.jerks
    return request.goal.velocities, request.final_accelerations, *bounds


def _interval(stops: bool, xp: Any, velocity: Any, given: Any, fastest: Any, limit: Any, jerk: Any) -> tuple[Any, Any]:
    """The interval of the final acceleration at a velocity. A prescribed acceleration is an interval of no width.

    The velocity peaks at v + a|a|/2J during the stop.
    """
    low, high = (_most(side * velocity, fastest, limit, jerk, stops, xp) for side in (-1.0, 1.0))
    outside, fixed = (given < -low) | (given > high), given == given
    return xp.where(outside, np.inf, xp.where(fixed, given, -low)), xp.where(fixed, given, high)


def _most(velocity: Any, fastest: Any, limit: Any, jerk: Any, stops: bool, xp: Any) -> Any:
    """Largest final acceleration upwards; 0 at the lower velocity limit, which a joint reaches from inside."""
    most = xp.where(velocity <= fastest * (ON_LIMIT - 1), 0.0, limit)
    if not stops:
        return most
    slower = xp.maximum(fastest + STOP_ROUNDING - velocity, 0.0)
    return xp.minimum(xp.minimum(most, UNLIMITED), xp.sqrt(2 * xp.minimum(jerk, UNLIMITED) * slower))


def final_accelerations(request: MotionRequest, remedy: bool = True) -> np.ndarray:
    """The part (J, 2) of the `arriving` interval from which the stop also keeps the position limits.

    With the tail "coast", the complete interval. Raises CannotStop if it is empty; if `remedy`, with a velocity from
    which the joint can stop.
    """
    interval = arriving(request)
    if request.tail == "coast":
        return interval
    low, high = _stoppable(request, interval)
    cannot_stop = np.flatnonzero(~(low <= high))
    if cannot_stop.size:
        joint = int(cannot_stop[0])
        raise CannotStop(joint, _max_velocity(request, joint) if remedy else None)
    return np.array([low, high]).T


def never_stops(request: MotionRequest, ends: list[Boundary]) -> np.ndarray:
    """Return for n ends which joints have no final acceleration that leaves room for the stop: (n, J).

    The test is sufficient for refusal only: the other ends may leave no room either.
    """
    joints = np.tile(np.arange(request.joint_count), len(ends))
    vectors = ([getattr(end, name) for end in ends] for name in ("positions", "velocities", "accelerations"))
    each = _ending_at(request, Boundary(*map(np.concatenate, vectors)), joints)
    low, high = _interval(True, np, *_arrival(each))
    some = low <= high
    stops = _stays(False, each, np.where(some, low, 0.0)) & _stays(True, each, np.where(some, high, 0.0))
    return ~(some & stops).reshape(len(ends), -1)


def _ending_at(request: MotionRequest, end: Boundary, joints: np.ndarray) -> MotionRequest:
    """The request with other ends, one for each of the `joints` (n,), with these joints alone."""
    own = request.limits
    limits = Limits(*(x[joints] for x in (own.positions, own.velocities, own.accelerations, own.jerks)))
    return replace(request, start=end, goal=end, limits=limits, waypoints=())


def _stoppable(request: MotionRequest, interval: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends (J,) of the part of an interval (J, 2) from which a stop keeps the position limits; empty if low > high.

    Both extremes of position increase with the acceleration at which the stop begins.
    """
    low, high = interval.T
    start = np.minimum(low, high)
    bottom = -_largest(lambda a: _stays(True, request, -a), -high, -start)
    top = _largest(lambda a: _stays(False, request, a), start, high)
    return np.where(low <= high, bottom, np.inf), top


def _stays(above: bool, request: MotionRequest, accelerations: np.ndarray) -> np.ndarray:
    """Whether stops from final accelerations (…, J) stay above the lower, or below the upper, position limits."""
    goal, limits = request.goal, request.limits
    stop = fastest_stop(goal.velocities, accelerations, limits.accelerations, limits.jerks)
    lowest, highest, _, _ = stop.extremes(request.stops_at)
    return (
        lowest >= limits.positions[:, 0] - STOP_ROUNDING if above else highest <= limits.positions[:, 1] + STOP_ROUNDING
    )


def _largest(
    holds: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray, tried: int = _TRIED
) -> np.ndarray:
    """Largest values (J,) in [low, high] for which a predicate holds; −inf if it holds for none of those tried.

    The predicate takes (n, J) and must hold on one interval. An interval between two values of the first round is
    missed.
    """
    left, right = low, high
    everywhere = holds(high[None])[0]
    if everywhere.all():
        return high
    somewhere = np.zeros(len(low), dtype=bool)
    joints = np.arange(len(low))
    for count in (tried,) + (_TRIED,) * _ROUNDS:
        points = left + (right - left) * np.linspace(0, 1, count)[:, None]
        points[0] = left
        works = holds(points)
        somewhere |= works.any(axis=0)
        last = count - 1 - works[::-1].argmax(axis=0)
        left, right = points[last, joints], points[np.minimum(last + 1, count - 1), joints]
    return np.where(everywhere, high, np.where(somewhere, left, -np.inf))


def _max_velocity(request: MotionRequest, joint: int) -> float | None:
    """Highest velocity up to the requested one from which one joint can stop, slightly below the true bound.

    None if there is none among the tried ones, which a prescribed final acceleration can cause. If that acceleration
    brakes, arrivals can also be too slow: the stop then swings back too far.
    """
    goal = request.goal
    sign = float(np.sign(goal.velocities[joint])) or 1.0

    def stoppable(speeds: np.ndarray) -> np.ndarray:
        chosen = np.full(speeds.size, joint)
        end = Boundary(goal.positions[chosen], sign * speeds.ravel(), goal.accelerations[chosen])
        each = _ending_at(request, end, chosen)
        low, high = _interval(True, np, *_arrival(each))
        # Of the accelerations that keep the upper limit, the largest is best for the lower limit.
        top = _largest(lambda a: _stays(False, each, a), np.minimum(low, high), high)
        stops = (low <= high) & np.isfinite(top)
        return (stops & _stays(True, each, np.where(stops, top, 0.0))).reshape(speeds.shape)

    largest = float(_largest(stoppable, np.zeros(1), np.abs(goal.velocities[[joint]]), TRIED)[0])
    return sign * largest * (1 - 1e-6) if np.isfinite(largest) else None
