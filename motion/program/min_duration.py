"""The shortest duration that works: above a request that is infeasible, or at all."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from motion.errors import SolverFailed
from motion.request import MotionRequest

FACTOR = 1.25
MAX_DURATION = 60.0

Failing = Callable[[MotionRequest, np.ndarray], np.ndarray]
"""Which of some joints (n,) cannot be planned. Raises SolverFailed with the status "time" where no effort is left."""


def stretched(request: MotionRequest, duration: float) -> MotionRequest:
    """Return the same request in another duration (s); the times of its waypoints scale along."""
    factor = duration / request.duration
    waypoints = tuple(replace(w, time_from_start=w.time_from_start * factor) for w in request.waypoints)
    return replace(request, duration=duration, waypoints=waypoints)


def min_duration(request: MotionRequest, failing: Failing, joints: np.ndarray, tick: float) -> MotionRequest | None:
    """Return the request in the shortest duration found to work above its own, a multiple of `tick`.

    None where none was found. `joints` are known to fail in the request's own duration. Goes upward by factors of 1.25,
    then bisects the last bracket to one tick or until the effort is spent: the shortest found, not the shortest there is.
    Each step asks first for the joints that failed in the step below, and for all where these work.
    """
    every = np.arange(request.joint_count)
    low, high = math.ceil(request.duration / tick - 1e-9), None
    step, works = low, joints

    def all_work(ticks: int) -> bool:
        nonlocal works
        longer = stretched(request, ticks * tick)
        failed = failing(longer, works)
        if not failed.size:
            failed = failing(longer, np.setdiff1d(every, works))
        if failed.size:
            works = np.union1d(works, failed) if high is None else works
        return not failed.size

    try:
        while high is None:
            step = max(math.ceil(step * FACTOR), step + 1)
            if step * tick > MAX_DURATION:
                return None
            if all_work(step):
                high = step
            else:
                low = step
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if all_work(middle) else (middle, high)
    except SolverFailed:
        pass  # the effort is spent
    return None if high is None else stretched(request, high * tick)
