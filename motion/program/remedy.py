"""What would work in place of a request that is infeasible: a longer duration, or a smaller rest_fraction."""

import math
from contextlib import suppress
from dataclasses import replace

from motion.errors import NONE_FOUND, NONE_TRIED, CannotStop, Infeasible, OutOfTime, SolverFailed
from motion.primitive import Primitive
from motion.program.contradiction import InfeasibleRows
from motion.program.effort import Effort
from motion.program.feasibility import FeasibilityCheck
from motion.program.min_duration import FACTOR, SEARCH_EFFORT, min_duration
from motion.program.problem import Precision
from motion.program.terminal_set import final_accelerations
from motion.request import MotionRequest

LESS_REST = 6_000.0
"""Effort of the search of a smaller rest_fraction, if no longer duration is feasible."""


def refusal(
    primitive: Primitive,
    request: MotionRequest,
    tick: float,
    failed: InfeasibleRows | SolverFailed,
    effort: Effort,
    remedy: bool,
    precision: Precision,
) -> Infeasible | SolverFailed:
    """The error of a request that failed, with a feasible duration if one is found.

    Raises CannotStop if the arm cannot come to rest inside its limits in any duration.
    """
    found = None
    if remedy and isinstance(failed, InfeasibleRows | OutOfTime):
        check = FeasibilityCheck(primitive, final_accelerations(request), effort, precision)
        low = math.ceil(request.duration / tick - 1e-9)
        guess = math.ceil(low * FACTOR)
        # At the demonstrated speed the motion may be feasible.
        shown = math.ceil((1 - request.phase) * primitive.duration / (1 - request.rest_fraction) / tick)
        if isinstance(failed, OutOfTime):
            guess = max(guess, shown)
        found = min_duration(request, check, low, guess, shown, tick)
    works = (found.duration, found.waypoint_times) if found else (None, None)
    if isinstance(failed, OutOfTime):
        return OutOfTime(failed.joint, *works)
    if isinstance(failed, SolverFailed):
        return failed
    advice = NONE_FOUND if remedy else NONE_TRIED
    if remedy and found is None and request.rest_fraction:
        less = _less_rest(primitive, request, precision)
        if less is not None:
            advice = f"a rest_fraction of {less:.6g} works"
    return failed.error(request, *works, otherwise=advice)


def _less_rest(primitive: Primitive, request: MotionRequest, precision: Precision) -> float | None:
    """Return a smaller rest_fraction with which the request is feasible in its duration, None if none is found."""
    effort, moving = Effort(LESS_REST), 1 - request.rest_fraction
    with suppress(OutOfTime, CannotStop):
        while moving < 1:
            moving = min(4 * moving, 1.0)
            less = replace(request, rest_fraction=round(1 - moving, 6))
            check = FeasibilityCheck(primitive, final_accelerations(less, remedy=False), effort, precision)
            if check.passes(less, SEARCH_EFFORT):
                return less.rest_fraction
    return None
