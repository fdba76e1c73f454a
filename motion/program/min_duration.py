"""Search of the shortest feasible duration: above that of an infeasible request, or of all."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from motion.errors import OutOfTime
from motion.program.effort import Effort
from motion.request import MotionRequest, Waypoint

FACTOR = 1.5
MAX_DURATION = 60.0

SEARCH_EFFORT, REFINE_EFFORT = 1_000.0, 2_000.0
"""Effort that one joint may take in one duration before its verdict is uncertain: until a feasible duration is found,
and while the shortest is searched."""

SCARCE = 0.4
"""When less than this part of the initial effort is left, the search jumps to the demonstrated duration."""

RESERVE = 0.1
"""The refinement of a feasible duration ends when this part of the effort at its begin is left."""


class Verdict(NamedTuple):
    """Verdict on a duration: feasible (no joint), or the joint that fails; not `certain` if the effort ran out."""

    joint: int | None = None
    certain: bool = True


Judge = Callable[[MotionRequest, list[int], float], Verdict]
"""Tries joints in order, each with an effort. Raises OutOfTime when the effort is spent."""


def stretched(request: MotionRequest, duration: float) -> MotionRequest:
    """Return the same request with another duration (s); the times of its waypoints scale with it."""
    factor = duration / request.duration
    waypoints = tuple(Waypoint(w.time_from_start * factor, w.positions, w.velocities) for w in request.waypoints)
    return replace(request, duration=duration, waypoints=waypoints)


def at_full_speed(request: MotionRequest) -> float:
    """Return a lower bound (s) of the duration.

    It is the time of the distance from start to goal at the velocity limits, or of the change of velocity at the
    acceleration limits, whichever is longer.
    """
    start, goal, limits = request.start, request.goal, request.limits
    ways = np.abs(goal.positions - start.positions) / limits.velocities
    changes = np.abs(goal.velocities - start.velocities) / limits.accelerations
    return float(np.maximum(ways, changes).max())


def min_duration(
    request: MotionRequest, judge: Judge, effort: Effort, low: int, guess: int, shown: int, tick: float
) -> MotionRequest | None:
    """Return the request in the shortest feasible duration that is found above `low` ticks, which is infeasible.

    None if none is found. The search goes up from `guess` ticks by factors of 1.5. When `effort` gets scarce it jumps
    to the `shown` ticks of the demonstration. Then it bisects between the last infeasible and the first feasible
    duration, to one tick or until little effort is left, so a shorter feasible duration may exist. Each step tries the
    joints that failed before first.
    """
    order = list(range(request.joint_count))
    low, high = max(low, math.floor(at_full_speed(request) / tick) - 1), None
    step, whole = max(guess, low + 1), effort.left

    def tried(ticks: int, effort: float) -> Verdict:
        verdict = judge(stretched(request, ticks * tick), order, effort)
        if verdict.joint is not None:
            order.remove(verdict.joint)
            order.insert(0, verdict.joint)
        return verdict

    try:
        while high is None and step * tick <= MAX_DURATION:
            joint, certain = tried(step, SEARCH_EFFORT)
            if joint is None:
                high = step
            else:
                low, step = step if certain else low, math.ceil(step * FACTOR)
                if effort.left < SCARCE * whole:
                    step = max(step, shown)
        least = RESERVE * effort.left
        while high is not None and high - low > 1 and effort.left > least:
            # Far above the lower end of the bracket, divide by the factor instead of bisecting.
            middle = max((low + high) // 2, math.floor(high / FACTOR))
            low, high = (low, middle) if tried(middle, REFINE_EFFORT).joint is None else (middle, high)
    except OutOfTime:
        pass
    return None if high is None else stretched(request, high * tick)
