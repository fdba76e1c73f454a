"""Search of the shortest feasible duration: above that of an infeasible request, or of all."""

import math

from motion.errors import OutOfTime
from motion.program.feasibility import FeasibilityCheck
from motion.request import MotionRequest

FACTOR = 1.5
MAX_DURATION = 60.0

SEARCH_EFFORT, REFINE_EFFORT = 1_000.0, 2_000.0
"""Effort that one joint may take in one duration before it counts as infeasible: until a feasible duration is found,
and while the shortest is searched."""

SCARCE = 0.4
"""When less than this part of the initial effort is left, the search jumps to the demonstrated duration."""

RESOLUTION = 0.01
"""The refinement also ends when the duration is known to this part of itself."""

NEXT = 1 / 3
"""Place in the bracket of the next duration that is tried: below the middle, because the rows that contradict each
other there often rule out longer durations too, without a program."""

RESERVE = 0.1
"""The refinement of a feasible duration ends when this part of the effort at its begin is left."""


def min_duration(
    request: MotionRequest, check: FeasibilityCheck, low: int, guess: int, shown: int, tick: float
) -> MotionRequest | None:
    """Return the request in the shortest feasible duration that is found above `low` ticks, which is infeasible.

    None if none is found. The search goes up from `guess` ticks by factors of 1.5. When effort gets scarce it jumps to
    the `shown` ticks of the demonstration. Then it narrows the bracket between the last infeasible and the first
    feasible duration, to a tick or `RESOLUTION` or until little effort is left, so a shorter feasible duration may
    exist.
    """
    high, effort = None, check.effort
    step, whole = max(guess, low + 1), effort.left
    try:
        while high is None and step * tick <= MAX_DURATION:
            if check.passes(request.stretched(step * tick), SEARCH_EFFORT):
                high = step
            else:
                low, step = step, math.ceil(step * FACTOR)
                if effort.left < SCARCE * whole:
                    step = max(step, shown)
        least = RESERVE * effort.left
        while high is not None and high - low > max(1, RESOLUTION * high) and effort.left > least:
            middle = low + math.ceil(NEXT * (high - low))
            works = check.passes(request.stretched(middle * tick), REFINE_EFFORT)
            low, high = (low, middle) if works else (middle, high)
    except OutOfTime:
        pass
    return None if high is None else request.stretched(high * tick)
