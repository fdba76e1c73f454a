"""Which final accelerations, and which final velocities, leave room for the stop after the hit."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from motion.braking import TOUCH, UNLIMITED, stop_extremes
from motion.errors import CannotStop
from motion.limits import SIGNS, Limits
from motion.request import Boundary, MotionRequest

ON_LIMIT = 1e-9
"""A velocity within this part of its limit lies on it."""

TRIED = 257
"""Values of a search's interval that are tried in each of its rounds."""

COARSE = 17
"""The same where only whether there is an interval counts."""

_ROUNDS = 3


def arriving(request: MotionRequest) -> np.ndarray:
    """The interval (J, 2) in which each joint's acceleration at the end of its moving part must lie, the position
    limits of the stop left aside.

    A given acceleration is an interval of no width. The velocity peaks at v + a|a|/2J during the stop.
    """
    limits, wanted = request.limits, request.final_accelerations
    # Row 0 is the lower end, with its sign turned.
    velocities = SIGNS[:, None] * request.goal.velocities
    # A joint that arrives at its velocity limit has come from inside it.
    from_inside = velocities <= limits.velocities * (ON_LIMIT - 1)
    reach = np.where(from_inside, 0.0, limits.accelerations)
    if request.tail == "stop":
        jerks, slower = np.minimum(limits.jerks, UNLIMITED), limits.velocities + TOUCH - velocities
        reach = np.minimum(np.minimum(reach, UNLIMITED), np.sqrt(2 * jerks * np.maximum(slower, 0.0)))
    low, high = -reach[0], reach[1]
    outside = (wanted < low) | (wanted > high)
    given = ~np.isnan(wanted)
    low, high = np.where(given, wanted, low), np.where(given, wanted, high)
    return np.array([np.where(outside, np.inf, low), high]).T


def final_accelerations(request: MotionRequest, remedy: bool = True) -> np.ndarray:
    """The part (J, 2) of the `arriving` interval from which the stop keeps the position limits as well.

    With the tail "coast" all of it. Raises CannotStop where there is none, with a velocity that could be stopped if a
    `remedy` is asked for.
    """
    interval = arriving(request)
    if request.tail == "coast":
        return interval
    low, high = _stoppable(request.stops_at, request.goal.velocities, interval, request.limits)
    stuck = np.flatnonzero(~(low <= high))
    if stuck.size:
        joint = int(stuck[0])
        raise CannotStop(joint, _max_velocity(request, joint) if remedy else None)
    return np.array([low, high]).T


def never_stops(request: MotionRequest, ends: list[Boundary]) -> np.ndarray:
    """Return for which of many ends (n,) and which joints even the final acceleration that helps most leaves no room
    for the stop: (n, J). Others may have none either."""
    joints = np.tile(np.arange(request.joint_count), len(ends))
    vectors = ([getattr(end, name) for end in ends] for name in ("positions", "velocities", "accelerations"))
    each = _ending_at(request, Boundary(*map(np.concatenate, vectors)), joints)
    low, high = arriving(each).T
    limits, stops_at = each.limits, each.stops_at
    bounds = limits.accelerations, limits.jerks
    braking, pushing = (np.where(low <= high, a, 0.0) for a in (low, high))
    _, highest, _, _ = stop_extremes(stops_at, each.goal.velocities, braking, *bounds)
    lowest, _, _, _ = stop_extremes(stops_at, each.goal.velocities, pushing, *bounds)
    stuck = (low > high) | (highest > limits.positions[:, 1] + TOUCH) | (lowest < limits.positions[:, 0] - TOUCH)
    return stuck.reshape(len(ends), -1)


def _ending_at(request: MotionRequest, end: Boundary, joints: np.ndarray) -> MotionRequest:
    """The request with other ends, each of one of its joints (n,)."""
    own = request.limits
    limits = Limits(*(x[joints] for x in (own.positions, own.velocities, own.accelerations, own.jerks)))
    return replace(request, start=end, goal=end, limits=limits, waypoints=())


def _stoppable(
    positions: np.ndarray, velocities: np.ndarray, interval: np.ndarray, limits: Limits, tried: int = TRIED
) -> tuple[np.ndarray, np.ndarray]:
    """Ends (J,) of the part of an interval (J, 2) from which a stop keeps the position limits; empty where low > high.

    Both extremes of position grow with the acceleration the stop starts from.
    """
    low, high = interval.T
    lowest, highest = limits.positions[:, 0] - TOUCH, limits.positions[:, 1] + TOUCH

    def below(a: np.ndarray) -> np.ndarray:
        _, p_max, _, _ = stop_extremes(positions, velocities, a, limits.accelerations, limits.jerks)
        return p_max <= highest

    def above(a: np.ndarray) -> np.ndarray:
        p_min, _, _, _ = stop_extremes(positions, velocities, -a, limits.accelerations, limits.jerks)
        return p_min >= lowest

    start = np.minimum(low, high)
    bottom, top = -_largest(above, -high, -start, tried), _largest(below, start, high, tried)
    return np.where(low <= high, bottom, np.inf), top


def _largest(
    holds: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray, tried: int = TRIED
) -> np.ndarray:
    """The largest values (J,) in [low, high] at which a predicate holds; −inf where it does at none of those tried.

    The predicate takes (n, J) and holds on one interval: what lies between two of the values tried first is not found.
    """
    left, right = low, high
    everywhere = holds(high[None])[0]
    somewhere = np.zeros(len(low), dtype=bool)
    joints = np.arange(len(low))
    for _ in range(_ROUNDS):
        points = left + (right - left) * np.linspace(0, 1, tried)[:, None]
        points[0] = left
        works = holds(points)
        somewhere |= works.any(axis=0)
        last = tried - 1 - works[::-1].argmax(axis=0)
        left, right = points[last, joints], points[np.minimum(last + 1, tried - 1), joints]
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
        low, high = _stoppable(each.stops_at, end.velocities, arriving(each), each.limits, COARSE)
        return (low <= high).reshape(speeds.shape)

    largest = float(_largest(stoppable, np.zeros(1), np.abs(goal.velocities[[joint]]))[0])
    return sign * largest * (1 - 1e-6) if np.isfinite(largest) else None
