"""The shortest duration that works: above a request that is infeasible, or at all."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from motion.errors import OutOfTime
from motion.request import MotionRequest

FACTOR = 1.5
MAX_DURATION = 60.0

FirstFailing = Callable[[MotionRequest, list[int]], int | None]
"""The first of some joints that cannot be planned, None where all can. Raises OutOfTime where no effort is left."""


def stretched(request: MotionRequest, duration: float) -> MotionRequest:
    """Return the same request in another duration (s); the times of its waypoints scale along."""
    factor = duration / request.duration
    waypoints = tuple(replace(w, time_from_start=w.time_from_start * factor) for w in request.waypoints)
    return replace(request, duration=duration, waypoints=waypoints)


def at_full_speed(request: MotionRequest) -> float:
    """Return the time (s) that the way from start to goal takes at the velocity limits, and the change of velocity at
    those of acceleration: no motion is faster."""
    start, goal, limits = request.start, request.goal, request.limits
    ways = np.abs(goal.positions - start.positions) / limits.velocities
    changes = np.abs(goal.velocities - start.velocities) / limits.accelerations
    return float(np.maximum(ways, changes).max())


def min_duration(
    request: MotionRequest, first_failing: FirstFailing, low: int, guess: int, tick: float
) -> MotionRequest | None:
    """Return the request in the shortest duration found to work above `low` ticks, where it does not.

    None where none was found. Goes upward from `guess` ticks by factors of 1.5, or downward if that works, then bisects
    the last bracket to one tick or until the effort is spent: the shortest found, not the shortest there is. Each step
    asks first for the joints that failed before.
    """
    order = list(range(request.joint_count))
    least = max(low, math.floor(at_full_speed(request) / tick) - 1)

    def works(ticks: int) -> bool:
        failed = first_failing(stretched(request, ticks * tick), order)
        if failed is not None:
            order.remove(failed)
            order.insert(0, failed)
        return failed is None

    high, low, step = None, least, max(guess, least + 1)
    try:
        while high is None and step * tick <= MAX_DURATION:
            low, high, step = (low, step, step) if works(step) else (step, None, math.ceil(step * FACTOR))
        while high is not None and high - low > 1:
            # Far above the bracket's lower end a factor is the better step.
            middle = max((low + high) // 2, math.floor(high / FACTOR))
            low, high = (low, middle) if works(middle) else (middle, high)
    except OutOfTime:
        pass
    return None if high is None else stretched(request, high * tick)
