"""The shortest duration above an infeasible request that works (design 1.8)."""

import math
from collections.abc import Callable
from dataclasses import replace

from motion.errors import InvalidMotion, LimitExceeded, SolverFailed
from motion.request import MotionRequest
from motion.solver import Clash

FACTOR = 1.15
MAX_DURATION = 10.0
MAX_PROBES = 60


def stretched(request: MotionRequest, duration: float) -> MotionRequest:
    """The same request in another duration (s); way-point times scale along."""
    factor = duration / request.duration
    waypoints = tuple(replace(w, time_from_start=w.time_from_start * factor) for w in request.waypoints)
    return replace(request, duration=duration, waypoints=waypoints)


def shortest_duration(
    request: MotionRequest, works: Callable[[MotionRequest], object], tick: float
) -> MotionRequest | None:
    """The request in the shortest duration found to work, a multiple of `tick`; None if none was found.

    Scans upward by factors of 1.15 up to 10 s, then bisects the last bracket to one tick: the shortest found
    above the request, not the shortest there is. `works` solves a request and raises where it cannot; a
    probe without a clear answer counts as infeasible.
    """

    def solved(ticks: int) -> bool:
        try:
            works(stretched(request, ticks * tick))
        except (Clash, SolverFailed, LimitExceeded, InvalidMotion):
            return False
        return True

    low = math.ceil(request.duration / tick - 1e-9)
    for _ in range(MAX_PROBES):
        high = max(math.ceil(low * FACTOR), low + 1)
        if high * tick > MAX_DURATION:
            return None
        if solved(high):
            break
        low = high
    else:
        return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if solved(middle) else (middle, high)
    return stretched(request, high * tick)
