"""Plan a motion from a primitive and a request, and verify it."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from motion.errors import InvalidMotion, OutOfTime, SolverFailed
from motion.limits import Limits
from motion.primitive import Primitive
from motion.program.constraint_generation import Solution
from motion.program.contradiction import InfeasibleRows
from motion.program.curves import curves_of, trajectory_of
from motion.program.effort import STOP, Effort
from motion.program.ending import Ending, ending
from motion.program.equalities import Fixed, fixed_inside, fixed_values
from motion.program.feasibility import FeasibilityCheck
from motion.program.min_duration import min_duration
from motion.program.optimum import WarmStart, optimum
from motion.program.problem import (
    FEWER_FUNCTIONS,
    FINEST,
    LEAST_ACCELERATION,
    MANY_FUNCTIONS,
    MIN_FUNCTIONS,
    USUAL,
    Precision,
    Problem,
    build,
    thinned,
)
from motion.program.remedy import refusal
from motion.program.report import Active, Report, make_report
from motion.program.terminal_set import arriving, final_accelerations
from motion.request import Boundary, MotionRequest
from motion.trajectory import Samples, Trajectory

__all__ = ["Active", "Plan", "Report", "Samples", "SplinePlan", "WarmStart", "plan", "plan_fastest", "prepare"]

EFFORT, MAX_EFFORT = 13_000.0, 45_000.0
"""Effort of a plan of up to six joints, and its maximum; it grows with the number of joints, and of functions beyond
`MANY_FUNCTIONS`. See `motion.program.effort`."""

SHARE, LEAST_ACCELERATION_SHARE = 0.5, 0.9
"""Parts of the remaining effort: for the usual precision and each thinned one, and for a motion that does not imitate.
The remainder is for the finest precision and for the search of another duration."""

BRIEF_PRECISIONS = (USUAL, SHARE), (LEAST_ACCELERATION, LEAST_ACCELERATION_SHARE)
"""Precisions for a duration in which a motion can hardly imitate."""

FASTEST_PRECISIONS = (USUAL, 0.35), (LEAST_ACCELERATION, 0.95)
"""Precisions for the shortest duration, in which many limits are active but no search follows."""

MIN_IMITATED = 0.25
"""A duration below this part of the demonstration's is planned without imitation if the usual precision fails; so short
a motion can hardly imitate."""


@dataclass(frozen=True, eq=False)
class Plan(ABC):
    """A motion: a moving part, and its ending.

    ending: a straight part if requested, and a stop. duration: from the start to the hit, s.
    """

    request: MotionRequest
    ending: Ending
    duration: float
    tick: float
    report: Report

    @property
    @abstractmethod
    def moving(self) -> Trajectory:
        """The part that imitates the demonstration."""

    @property
    def total_duration(self) -> float:
        """Duration with the stop, s, a multiple of `tick`."""
        return math.ceil((self.moving_duration + self.ending.duration) / self.tick - 1e-9) * self.tick

    @property
    def hit_index(self) -> int:
        """Index of the tick nearest to the hit."""
        return round(self.duration / self.tick)

    @property
    def moving_duration(self) -> float:
        """Duration of the moving part, s."""
        return self.duration - self.request.rest_fraction * self.request.duration

    @cached_property
    def trajectory(self) -> Trajectory:
        """The complete motion: moving part and ending."""
        return self.moving.then(self.ending.trajectory())

    def sample(self, times: np.ndarray) -> Samples:
        """States at `times` (n,), s from the start.

        After its end a motion is at rest; with the tail "coast" it continues.
        """
        return self.trajectory.sample(times)

    def samples(self) -> Samples:
        """States at all ticks from 0 to `total_duration`; the last is at rest with the tail "stop"."""
        count = round(self.total_duration / self.tick)
        return self.sample(np.arange(count + 1) * self.tick)


@dataclass(frozen=True, eq=False)
class SplinePlan(Plan):
    """A motion that keeps its limits at all times.

    control_points (J, N + 2): of the position over the moving part, rad. warm: the active rows, for a warm start of the
    next plan.
    """

    control_points: np.ndarray
    warm: WarmStart

    @property
    def moving(self) -> Trajectory:
        """The spline as polynomials between its knots."""
        return trajectory_of(curves_of(self.control_points), self.request.moving_duration)


def plan(
    primitive: Primitive,
    request: MotionRequest,
    tick: float = 0.001,
    warm: WarmStart | None = None,
    remedy: bool = True,
    thorough: bool = True,
    effort: Effort | None = None,
    precisions: Sequence[tuple[Precision, float]] | None = None,
) -> SplinePlan:
    """Plan the motion that imitates `primitive` best as `request` demands (eq. 10–17).

    tick: grid of the total duration, s. warm: active rows of an earlier plan of the same joints. remedy: search a
    feasible duration for the error of an infeasible request. thorough: try the finest hull before the request is
    refused. effort: the effort that may be spent. precisions: to try in order, each with its part of the effort that is
    left. Raises InvalidMotion, LimitExceeded, CannotStop, Infeasible or SolverFailed.
    """
    primitive.check_joints(request.joint_count)
    if warm is not None and len(warm.rows) != request.joint_count:
        raise InvalidMotion("warm", f"belongs to {len(warm.rows)} joints, not to {request.joint_count}")
    request, fixed = fixed_inside(request)
    effort, precision = effort or effort_for(primitive), USUAL
    failed: InfeasibleRows | SolverFailed = OutOfTime(0)
    for precision, most in precisions or _precisions(primitive, request):
        with effort.share(most * effort.left) as share:
            try:
                return _planned(primitive, request, fixed, tick, warm, share, precision, remedy)
            except SolverFailed as failure:
                failed = failure
            except InfeasibleRows as failure:
                failed = failure
                if precision.thinning == 1:
                    break
    if thorough and precision.thinning == 1 and isinstance(failed, InfeasibleRows):
        with effort.share(effort.left / 4) as share, suppress(SolverFailed):
            finest = replace(FINEST, imitates=precision.imitates)
            try:
                return _planned(primitive, request, fixed, tick, None, share, finest, remedy)
            except InfeasibleRows as failure:
                failed = failure
    raise refusal(primitive, request, tick, failed, effort, remedy, precision) from None


def prepare(primitive: Primitive) -> None:
    """Build the matrices that all plans of a primitive share, so that its first goal does not wait for them.

    This takes up to a second for hundreds of functions.
    """
    joints = primitive.joint_count
    rest, free = np.zeros(joints), np.full(joints, np.nan)
    start = Boundary(primitive.start.positions, rest, rest)
    for velocities in (rest, np.ones(joints)):
        goal = Boundary(primitive.goal.positions, velocities, free)
        request = MotionRequest(start, goal, primitive.duration, Limits.unlimited(joints), tail="coast")
        for precision, _ in _precisions(primitive, request):
            build(primitive, request, fixed_values(request), arriving(request), precision)


def effort_for(primitive: Primitive) -> Effort:
    """Return the effort that a plan of a primitive may spend."""
    usual = EFFORT * max(1.0, primitive.joint_count / 6)
    return Effort(max(usual, min(usual * primitive.basis_count / MANY_FUNCTIONS, MAX_EFFORT)))


def plan_fastest(primitive: Primitive, request: MotionRequest, tick: float = 0.001) -> SplinePlan:
    """Plan in the shortest duration, a multiple of `tick`, that is found to keep the limits.

    Raises the errors of `plan`; if no duration works, the error for the demonstration's duration.
    """
    primitive.check_joints(request.joint_count)
    request, effort = request.clipped(), effort_for(primitive)
    goal = np.array([request.goal.positions, request.goal.velocities])
    if error := request.limits.exceeded(np.arange(2), goal):
        raise error
    check, shown = FeasibilityCheck(primitive, final_accelerations(request), effort), round(primitive.duration / tick)
    # With a straight part only short durations may be feasible.
    found = min_duration(request, check, 0, shown, shown, tick) or min_duration(request, check, 0, 1, 1, tick)
    if found is None:
        return plan(primitive, request.stretched(primitive.duration), tick)
    return plan(primitive, found, tick, remedy=False, precisions=FASTEST_PRECISIONS)


def _planned(
    primitive: Primitive,
    request: MotionRequest,
    fixed: Fixed,
    tick: float,
    warm: WarmStart | None,
    effort: Effort,
    precision: Precision,
    remedy: bool,
) -> SplinePlan:
    """The plan with a given precision. Raises InfeasibleRows if the limits cannot be kept."""
    problem = build(primitive, request, fixed, arriving(request), precision)
    solution = optimum(problem, effort, warm)
    end = _ending(request, problem, solution)
    cannot_stop = end.cannot_stop()
    if cannot_stop.size:
        # Computed only here, because few motions need it: which final accelerations leave room for the stop.
        effort.spend(int(cannot_stop[0]), STOP)
        problem = build(primitive, request, fixed, final_accelerations(request, remedy), precision)
        solution.replace(optimum(problem, effort, WarmStart.of(problem, solution), cannot_stop), cannot_stop)
        end = _ending(request, problem, solution)
        if (cannot_stop := end.cannot_stop()).size:
            raise SolverFailed(int(cannot_stop[0]), "the stop after the goal leaves the limits")
    points = problem.space.positions(solution.x)
    if not precision.imitates:  # The report compares with the imitating optimum anyway.
        compared = replace(precision, imitates=True)
        problem = replace(problem, origin=build(primitive, request, fixed, arriving(request), compared).origin)
    report = make_report(primitive, problem, solution, points, end)
    return SplinePlan(request, end, request.duration, tick, report, points, WarmStart.of(problem, solution))


def _ending(request: MotionRequest, problem: Problem, solution: Solution) -> Ending:
    goal, last = request.goal, solution.x @ problem.hull.rows[problem.hull.last_acceleration] / problem.duration**2
    positions, final = goal.positions, request.final_accelerations
    if request.rest_fraction:
        positions = positions - request.rest_fraction * request.duration * goal.velocities
    return ending(request, Boundary(positions, goal.velocities, np.where(np.isnan(final), last, final)))


def _precisions(primitive: Primitive, request: MotionRequest) -> list[tuple[Precision, float]]:
    """Precisions in the order in which they are tried, each with its part of the effort that is left."""
    count = primitive.basis_count
    if count <= MANY_FUNCTIONS and request.duration < MIN_IMITATED * (1 - request.phase) * primitive.duration:
        return list(BRIEF_PRECISIONS)
    return [
        (USUAL, SHARE),
        *((each, SHARE) for each in FEWER_FUNCTIONS if thinned(count, each.thinning) >= MIN_FUNCTIONS),
    ]
