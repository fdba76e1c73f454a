"""Plan a goal from its origin, by the requested method, and check the plan."""

import math
import time
from collections.abc import Generator
from dataclasses import dataclass, field, replace
from itertools import chain, count
from typing import TypeVar

from motion.alternatives import AllRefused, plan_best
from motion.dmp_plan import plan_dmp
from motion.errors import MotionError, OutOfTime
from motion.plan import Plan, SplinePlan, WarmStart, plan, plan_fastest
from motion.primitive import Primitive
from motion.request import MotionRequest
from motion.sampled import SampledPlan, check_limits
from protocol import messages as m
from protocol.errors import Refusal
from protocol.topics import MAX_PLAN_S
from robot.description import RobotConfig
from robot.motion_check import Findings, MotionCheck
from robot.torque_check import TorqueExceeded
from services.planner.goal_checks import too_long
from services.planner.goals import Origin, ends, motion_request
from services.planner.refusals import joints_of, none_of, refusal_of
from services.planner.tool_goals import ToolSpace, is_in_tool_space
from services.planner.worker import Task

ELSEWHERE = frozenset({"gaussian"})
"""Methods that plan in a worker process, because they take 30 to 80 ms a joint."""

SLOWER, GROWTH = (1.05, 1.1, 1.2, 1.35, 1.6, 2.0, 3.0, 5.0), 1.6
"""Factors of a duration that needs too much torque: durations to try instead, in this order, and how they go on."""
MOST_SLOWER = 5.0
"""Such durations are at most this many times the longer one of the requested and the demonstrated duration."""
PRECISION = 0.01
"""Part of its duration, or a tick, by which a goal with `fastest` may be slower than its torques demand."""
NO_DURATION = "no longer duration was found to work; change the goal or its velocities"


def effort_of(goal: m.Goal) -> str:
    """Return the kind of a goal for planning times: `tool`, `correction`, or the method."""
    if goal.method == "qp" and goal.revises is not None:
        return "correction"
    return "tool" if is_in_tool_space(goal) and goal.revises is None else goal.method


ResultT = TypeVar("ResultT")
Steps = Generator[Task | None, SampledPlan, ResultT]
"""Generator of a goal in progress: yields a task for the worker process, and receives its plan."""


class Verifier:
    """Checks the plans of one goal, and keeps the findings of the last valid plan.

    findings: empty before a plan has passed.
    """

    def __init__(self, motions: MotionCheck, goal: m.Goal, begin: float | None) -> None:
        """Prepare for plans of `goal` that start at `begin`, s on the robot's clock; None: at an unknown time."""
        self.findings = Findings()
        self._motions = motions
        self._goal = goal
        self._begin = begin

    def __call__(self, plan: Plan) -> None:
        """Check a plan.

        Raises:
            Refusal: the plan is too long.
            MotionError: Collides or TorqueExceeded.
        """
        if plan.total_duration > MAX_PLAN_S + plan.tick / 2:
            raise too_long(self._goal, plan.duration, plan.total_duration)
        checks = self._goal.checks
        self.findings = self._motions.check(
            plan.trajectory, plan.total_duration, checks.collision, checks.torque, self._begin
        )


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """A plan, the index of its end (0: the goal's own), its origin, its planning time, and its check's findings."""

    plan: Plan
    alternative: int
    origin: Origin
    solve_ms: float
    findings: Findings = field(default_factory=Findings)


@dataclass(frozen=True, slots=True, eq=False)
class _Case:
    """A goal in joint space, and the verifier of its plan.

    whose: for each end the index of the end in the goal as it was sent, which may be in tool space.
    """

    goal: m.Goal
    primitive: Primitive
    request: MotionRequest
    origin: Origin
    whose: list[int]
    verify: Verifier

    @property
    def may_take_longer(self) -> bool:
        """Whether the duration may be changed: not for an arrival time."""
        goal = self.goal
        return goal.arrival_time is None and (self.origin.correction is None or goal.duration is not None)


class Solver:
    """Plans goals; each plan starts with the working set of the last plan of the same primitive."""

    def __init__(self, config: RobotConfig) -> None:
        self.motions = MotionCheck(config)
        self._config = config
        self._tool_space = ToolSpace(config)
        self._warm: dict[str, WarmStart] = {}

    def warm_up(self) -> None:
        """Load and warm up the modules for goals in tool space."""
        self._tool_space.warm_up()

    def forget(self, primitive: str) -> None:
        """Drop the working set of a primitive that has changed."""
        self._warm.pop(primitive, None)

    def solve(self, goal: m.Goal, primitive: Primitive, origin: Origin) -> Steps[Made]:
        """Plan `goal`, which has passed `check_goal`.

        Raises:
            Refusal: the goal cannot be planned.
        """
        whose = list(range(1 + len(goal.alternatives)))
        if is_in_tool_space(goal):
            try:
                goal, whose = self._tool_space.in_joint_space(goal, primitive, origin)
            except Refusal as refusal:
                if refusal.code != "unreachable":
                    raise
                raise none_of([refusal] * len(whose), whose, joints_of(self._config)) from None
        request = motion_request(goal, primitive, self._config, origin)
        case = _Case(goal, primitive, request, origin, whose, self._verifier(goal, origin))
        began, alternative = time.perf_counter(), 0
        try:
            if goal.method == "qp":
                alternative, made = self._planned(case)
            else:
                made = yield from self._sampled(case)
        except MotionError as error:
            raise refusal_of(error, joints_of(self._config)) from None
        solve_ms = (time.perf_counter() - began) * 1e3
        return Made(made, whose[alternative], origin, solve_ms, case.verify.findings)

    def checked(self, made: Made, goal: m.Goal) -> Made:
        """Check a plan of `goal` for collisions again, after the scene has changed.

        Raises:
            Refusal: it collides now.
        """
        verify = self._verifier(goal, made.origin)
        try:
            verify(made.plan)
        except MotionError as error:
            raise refusal_of(error, joints_of(self._config)) from None
        return replace(made, findings=verify.findings)

    def _verifier(self, goal: m.Goal, origin: Origin) -> Verifier:
        return Verifier(self.motions, goal, None if goal.start is not None else origin.time)

    def _sampled(self, case: _Case) -> Steps[SampledPlan]:
        """Plan by a method whose limits are checked on samples; a plan-only goal may exceed them."""
        tick = self._config.tick
        if case.goal.method in ELSEWHERE:
            made = yield Task(case.primitive, case.request, tick, joints_of(self._config))
        else:
            made = plan_dmp(case.primitive, case.request, tick)
        if not case.goal.plan_only:
            check_limits(made)
        case.verify(made)
        return made

    def _planned(self, case: _Case) -> tuple[int, SplinePlan]:
        """Return the chosen end and its plan, by the method "qp"."""
        alternative = 0
        if case.goal.alternatives:
            alternative, made = self._best(case)
        elif case.goal.fastest:
            made = self._fastest(case)
        else:
            made = self._own(case)
        self._warm[case.goal.primitive] = made.warm
        return alternative, made

    def _best(self, case: _Case) -> tuple[int, SplinePlan]:
        """Return the best end and its plan.

        If none was found, the goal's own end is planned alone: if its share of the planning time ran out, or if the
        refusal can then name a duration that works.
        """
        found, late = ends(case.goal, case.primitive, case.request, self._config, case.origin)
        which, offered = list(found), list(found.values())
        errors: dict[int, MotionError | Refusal] = dict(late)
        if offered:
            warm = self._warm.get(case.goal.primitive)
            try:
                best, made = plan_best(case.primitive, case.request, offered, self._config.tick, warm, case.verify)
                return which[best], made
            except AllRefused as refused:
                errors |= dict(zip(which, refused.errors, strict=True))
        own, *others = (errors[index] for index in sorted(errors))
        if isinstance(own, OutOfTime) or case.may_take_longer:
            try:
                return 0, self._own(case)
            except MotionError as error:
                own = error
        raise none_of([own, *others], case.whose, joints_of(self._config))

    def _own(self, case: _Case) -> SplinePlan:
        """Return the plan of the goal's own end."""
        remedy = case.may_take_longer
        made = plan(case.primitive, case.request, self._config.tick, self._warm.get(case.goal.primitive), remedy)
        try:
            case.verify(made)
        except TorqueExceeded as error:
            if not remedy:
                raise
            slower, _ = self._slower(case, case.request)
            if slower is None:
                raise replace(error, otherwise=NO_DURATION) from None
            works = slower.request
            raise replace(error, min_duration=works.duration, waypoint_times=works.waypoint_times) from None
        return made

    def _fastest(self, case: _Case) -> SplinePlan:
        """Return the plan in the shortest duration found that keeps all limits, also of torques."""
        made = plan_fastest(case.primitive, case.request, self._config.tick)
        try:
            case.verify(made)
        except TorqueExceeded as error:
            slower, failed = self._slower(case, made.request)
            if slower is None:
                raise replace(error, otherwise=NO_DURATION) from None
            return self._shortened(case, slower, failed)
        return made

    def _slower(self, case: _Case, request: MotionRequest) -> tuple[SplinePlan | None, int]:
        """Return a valid plan with a longer duration than that of `request`, or None; and the longest that failed.

        The duration that failed is in ticks.
        """
        longest = min(MAX_PLAN_S, MOST_SLOWER * max(request.duration, case.primitive.duration))
        failed = round(request.duration * self._config.rate_hz)
        for factor in chain(SLOWER, (SLOWER[-1] * GROWTH**k for k in count(1))):
            ticks = math.ceil(factor * request.duration * self._config.rate_hz)
            if ticks > longest * self._config.rate_hz:
                break
            if slow := self._in_ticks(case, request, ticks):
                return slow, failed
            failed = ticks
        return None, failed

    def _shortened(self, case: _Case, found: SplinePlan, failed: int) -> SplinePlan:
        """Return a valid plan in nearly the shortest duration between `failed`, in ticks, and that of `found`.

        The verifier then has the findings of this plan, the last valid one.
        """
        works = round(found.duration * self._config.rate_hz)
        while works - failed > max(1, PRECISION * failed):
            middle = (failed + works) // 2
            if shorter := self._in_ticks(case, found.request, middle):
                found, works = shorter, middle
            else:
                failed = middle
        return found

    def _in_ticks(self, case: _Case, request: MotionRequest, ticks: int) -> SplinePlan | None:
        """Return the plan of `request` in a duration of `ticks`, or None if it is not valid."""
        try:
            slow = request.stretched(ticks / self._config.rate_hz)
            made = plan(case.primitive, slow, self._config.tick, remedy=False, thorough=False)
            case.verify(made)
        except (MotionError, Refusal):  # a Refusal: with its stop it is too long
            return None
        return made
