"""The shortest duration that works: above a request that is infeasible, or at all."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from motion.errors import OutOfTime
from motion.program.effort import Effort
from motion.request import MotionRequest

FACTOR = 1.5
MAX_DURATION = 60.0

LOOK, PROBE = 1_000.0, 2_000.0
"""The effort after which it is unknown whether a joint works in the duration that is tried: on the way to the first
that works, and when the shortest is looked for."""

UNSURE = 0.4
"""Once less of the effort is left than this part of what there was at first, no small steps are tried any more."""

REFINING = 0.1
"""A duration that works is refined until so much of the effort is left that there was when it was found."""


class Verdict(NamedTuple):
    """Verdict on a duration: feasible (no joint), or the joint that fails, for certain or because effort ran out."""

    joint: int | None = None
    certain: bool = True


Judge = Callable[[MotionRequest, list[int], float], Verdict]
"""Tries joints in order, each with an effort. Raises OutOfTime where all effort is spent."""


def stretched(request: MotionRequest, duration: float) -> MotionRequest:
    """Return the same request in another duration (s); the times of its waypoints scale along."""
    factor = duration / request.duration
    waypoints = tuple(replace(w, time_from_start=w.time_from_start * factor) for w in request.waypoints)
    return replace(request, duration=duration, waypoints=waypoints)


def at_full_speed(request: MotionRequest) -> float:
    """Return a lower bound (s) of the duration.

    It is the time of the way from start to goal at the velocity limits, and of the change of velocity at the
    acceleration limits.
    """
    start, goal, limits = request.start, request.goal, request.limits
    ways = np.abs(goal.positions - start.positions) / limits.velocities
    changes = np.abs(goal.velocities - start.velocities) / limits.accelerations
    return float(np.maximum(ways, changes).max())


def min_duration(
    request: MotionRequest, judge: Judge, effort: Effort, low: int, guess: int, shown: int, tick: float
) -> MotionRequest | None:
    """Return the request in the shortest duration found to work above `low` ticks, where it does not.

    None where none was found. Goes upward from `guess` ticks by factors of 1.5, and, when `effort` gets scarce, on
    from the `shown` ticks of the demonstration, or downward if that works, then bisects the last bracket to one tick or
    until little effort is left: the shortest found, not the shortest there is. Each step asks first for the joints that
    failed before.
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
            joint, certain = tried(step, LOOK)
            if joint is None:
                high = step
            else:
                low, step = step if certain else low, math.ceil(step * FACTOR)
                if effort.left < UNSURE * whole:
                    step = max(step, shown)
        least = REFINING * effort.left
        while high is not None and high - low > 1 and effort.left > least:
            # Far above the bracket's lower end a factor is the better step.
            middle = max((low + high) // 2, math.floor(high / FACTOR))
            low, high = (low, middle) if tried(middle, PROBE).joint is None else (middle, high)
    except OutOfTime:
        pass
    return None if high is None else stretched(request, high * tick)
