"""Which final accelerations, and which final velocities, leave room for the stop after the hit."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from motion.braking import TOUCH, UNLIMITED, Floats, fastest_stop
from motion.errors import CannotStop
from motion.limits import Limits
from motion.request import Boundary, MotionRequest

ON_LIMIT = 1e-9
"""A velocity within this part of its limit lies on it."""

TRIED = 257
"""Velocities that are tried at first where those that can be stopped need not reach down to zero."""

_TRIED = 17
"""Values that are tried in each other round of a search."""

_ROUNDS = 5
"""After the first, each of which narrows the interval by `_TRIED` - 1: to a millionth."""


def arriving(request: MotionRequest) -> np.ndarray:
    """Return the interval (J, 2) of the acceleration at the end of each joint's moving part.

    Position limits of the stop are not considered here.
    """
    each = zip(*(values.tolist() for values in _arrival(request)), strict=True)
    return np.array([_interval(request.tail == "stop", Floats, *joint) for joint in each])


def _arrival(request: MotionRequest) -> tuple[np.ndarray, ...]:
    limits = request.limits
    bounds = limits.velocities, limits.accelerations, limits.jerks
    return request.goal.velocities, request.final_accelerations, *bounds


def _interval(stops: bool, xp: Any, velocity: Any, given: Any, fastest: Any, limit: Any, jerk: Any) -> tuple[Any, Any]:
    """The interval of the final acceleration at a velocity. One that is given is an interval of no width.

    The velocity peaks at v + a|a|/2J during the stop.
    """
    low, high = (_most(side * velocity, fastest, limit, jerk, stops, xp) for side in (-1.0, 1.0))
    outside, fixed = (given < -low) | (given > high), given == given
    return xp.where(outside, np.inf, xp.where(fixed, given, -low)), xp.where(fixed, given, high)


def _most(velocity: Any, fastest: Any, limit: Any, jerk: Any, stops: bool, xp: Any) -> Any:
    """The largest final acceleration upwards. A joint that arrives at its lower velocity limit comes from inside it."""
    most = xp.where(velocity <= fastest * (ON_LIMIT - 1), 0.0, limit)
    if not stops:
        return most
    slower = xp.maximum(fastest + TOUCH - velocity, 0.0)
    return xp.minimum(xp.minimum(most, UNLIMITED), xp.sqrt(2 * xp.minimum(jerk, UNLIMITED) * slower))


def final_accelerations(request: MotionRequest, remedy: bool = True) -> np.ndarray:
    """The part (J, 2) of the `arriving` interval from which the stop keeps the position limits as well.

    With the tail "coast" all of it. Raises CannotStop where there is none, with a velocity that could be stopped if a
    `remedy` is asked for.
    """
    interval = arriving(request)
    if request.tail == "coast":
        return interval
    low, high = _stoppable(request, interval)
    stuck = np.flatnonzero(~(low <= high))
    if stuck.size:
        joint = int(stuck[0])
        raise CannotStop(joint, _max_velocity(request, joint) if remedy else None)
    return np.array([low, high]).T


def never_stops(request: MotionRequest, ends: list[Boundary]) -> np.ndarray:
    """Return for which of n ends and which joints no final acceleration leaves room for the stop: (n, J).

    The test is necessary only: others may have no room either.
    """
    joints = np.tile(np.arange(request.joint_count), len(ends))
    vectors = ([getattr(end, name) for end in ends] for name in ("positions", "velocities", "accelerations"))
    each = _ending_at(request, Boundary(*map(np.concatenate, vectors)), joints)
    low, high = _interval(True, np, *_arrival(each))
    some = low <= high
    stops = _stays(False, each, np.where(some, low, 0.0)) & _stays(True, each, np.where(some, high, 0.0))
    return ~(some & stops).reshape(len(ends), -1)


def _ending_at(request: MotionRequest, end: Boundary, joints: np.ndarray) -> MotionRequest:
    """The request with other ends, each of one of its joints (n,)."""
    own = request.limits
    limits = Limits(*(x[joints] for x in (own.positions, own.velocities, own.accelerations, own.jerks)))
    return replace(request, start=end, goal=end, limits=limits, waypoints=())


def _stoppable(request: MotionRequest, interval: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends (J,) of the part of an interval (J, 2) from which a stop keeps the position limits; empty where low > high.

    Both extremes of position grow with the acceleration the stop starts from.
    """
    low, high = interval.T
    start = np.minimum(low, high)
    bottom = -_largest(lambda a: _stays(True, request, -a), -high, -start)
    top = _largest(lambda a: _stays(False, request, a), start, high)
    return np.where(low <= high, bottom, np.inf), top


def _stays(above: bool, request: MotionRequest, accelerations: np.ndarray) -> np.ndarray:
    """Whether stops from some final accelerations (…, J) stay above the lower or below the upper position limits."""
    goal, limits = request.goal, request.limits
    stop = fastest_stop(goal.velocities, accelerations, limits.accelerations, limits.jerks)
    lowest, highest, _, _ = stop.extremes(request.stops_at)
    return lowest >= limits.positions[:, 0] - TOUCH if above else highest <= limits.positions[:, 1] + TOUCH


def _largest(
    holds: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray, tried: int = _TRIED
) -> np.ndarray:
    """The largest values (J,) in [low, high] at which a predicate holds; −inf where it does at none of those tried.

    The predicate takes (n, J) and holds on one interval: what lies between two of the values tried first is not found.
    """
    left, right = low, high
    everywhere = holds(high[None])[0]
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
    """The largest velocity up to the one asked for from which one joint could stop, a little below the bound itself.

    None where it could from none of those tried, which a given final acceleration can bring about. With one that
    brakes, arrivals can be too slow as well: the stop swings back too far.
    """
    goal = request.goal
    sign = float(np.sign(goal.velocities[joint])) or 1.0

    def stoppable(speeds: np.ndarray) -> np.ndarray:
        chosen = np.full(speeds.size, joint)
        end = Boundary(goal.positions[chosen], sign * speeds.ravel(), goal.accelerations[chosen])
        each = _ending_at(request, end, chosen)
        low, high = _interval(True, np, *_arrival(each))
        # The largest acceleration that keeps the upper limit is the one that is best for the lower.
        top = _largest(lambda a: _stays(False, each, a), np.minimum(low, high), high)
        stops = (low <= high) & np.isfinite(top)
        return (stops & _stays(True, each, np.where(stops, top, 0.0))).reshape(speeds.shape)

    largest = float(_largest(stoppable, np.zeros(1), np.abs(goal.velocities[[joint]]), TRIED)[0])
    return sign * largest * (1 - 1e-6) if np.isfinite(largest) else None
