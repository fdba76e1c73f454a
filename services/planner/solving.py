"""From a goal and its origin to a plan, by the method that it asks for."""

import time
from collections.abc import Generator
from dataclasses import dataclass
from typing import TypeVar

from motion.alternatives import AllRefused, plan_best
from motion.dmp_plan import plan_dmp
from motion.errors import MotionError, OutOfTime
from motion.plan import Plan, Warm, plan, plan_fastest
from motion.primitive import Primitive
from motion.request import MotionRequest
from motion.sampled import SampledPlan, check_limits
from protocol import messages as m
from protocol.topics import MAX_PLAN_S
from robot.description import RobotConfig
from services.planner.goal_checks import too_long
from services.planner.goals import Origin, ends, motion_request
from services.planner.refusals import none_of, refusal_of
from services.planner.tool_goals import ToolSpace, is_in_tool_space
from services.planner.worker import Task

ELSEWHERE = frozenset({"gaussian"})
"""Methods that plan in a process beside the loop's: 30 to 80 ms a joint."""


def effort_of(goal: m.Goal) -> str:
    """Return what goals must have in common to take about as long to plan: `tool`, or the method."""
    return "tool" if is_in_tool_space(goal) and goal.revises is None else goal.method


ResultT = TypeVar("ResultT")
Steps = Generator[Task | None, SampledPlan, ResultT]
"""A goal on its way: it yields what is to be planned elsewhere and goes on with the plan."""


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """A plan, to which end (0 the goal's own), from which origin, and what it took."""

    plan: Plan | SampledPlan
    alternative: int
    origin: Origin
    solve_ms: float


class Solver:
    """Plans goals; each plan begins with the rows of the last one of the same primitive."""

    def __init__(self, config: RobotConfig) -> None:
        self._config = config
        self._tool_space = ToolSpace(config)
        self._warm: dict[str, Warm] = {}

    def prepare(self, goal: m.Goal) -> None:
        """Load what goals in tool space need, if this is one, so that its planning takes no longer than the next's."""
        if is_in_tool_space(goal):
            _ = self._tool_space.kinematics

    def forget(self, primitive: str) -> None:
        """Forget the rows of a primitive that is no longer what it was."""
        self._warm.pop(primitive, None)

    def solve(self, goal: m.Goal, primitive: Primitive, origin: Origin) -> Steps[Made]:
        """Plan `goal`; `check_goal` has passed.

        Raises:
            Refusal: what stands in its way.
        """
        is_of_tool = goal.tool is not None
        if is_in_tool_space(goal):
            goal = self._tool_space.in_joint_space(goal, primitive, origin)
        request = motion_request(goal, primitive, self._config, origin)
        began, tick = time.perf_counter(), self._config.tick
        alternative, sampled = 0, None
        try:
            if goal.method in ELSEWHERE:
                sampled = yield Task(primitive, request, tick)
            elif goal.method == "dmp":
                sampled = plan_dmp(primitive, request, tick)
            if sampled is not None and not goal.plan_only:
                check_limits(sampled)
            if sampled is None:
                alternative, made = self._planned(goal, primitive, request, origin)
            else:
                made = sampled
        except MotionError as error:
            raise refusal_of(error, self._config.joint_names) from None
        if made.total_duration > MAX_PLAN_S + tick / 2:
            raise too_long(goal, made.duration, made.total_duration)
        return Made(made, 0 if is_of_tool else alternative, origin, (time.perf_counter() - began) * 1e3)

    def _planned(self, goal: m.Goal, primitive: Primitive, request: MotionRequest, origin: Origin) -> tuple[int, Plan]:
        """The end that is played and its plan, by the method "qp"."""
        warm, alternative = self._warm.get(goal.primitive), 0
        if goal.alternatives:
            alternative, made = self._best(goal, primitive, request, origin, warm)
        elif goal.fastest:
            made = plan_fastest(primitive, request, self._config.tick)
        else:
            made = self._own(goal, primitive, request, origin, warm)
        self._warm[goal.primitive] = made.warm
        return alternative, made

    def _best(
        self, goal: m.Goal, primitive: Primitive, request: MotionRequest, origin: Origin, warm: Warm | None
    ) -> tuple[int, Plan]:
        """Return the best end and its plan.

        If none was found and planning time ran out for the goal's own end, that end is planned as if it were alone.
        """
        found = ends(goal, request, self._config, origin)
        try:
            return plan_best(primitive, request, found, self._config.tick, warm)
        except AllRefused as refused:
            own, *others = refused.errors
        if isinstance(own, OutOfTime):
            try:
                return 0, self._own(goal, primitive, request, origin, warm)
            except MotionError as error:
                own = error
        raise none_of([own, *others], self._config.joint_names)

    def _own(
        self, goal: m.Goal, primitive: Primitive, request: MotionRequest, origin: Origin, warm: Warm | None
    ) -> Plan:
        """The plan of the goal's own end."""
        # Another duration is no answer to who must be there in time.
        remedy = goal.arrival_time is None and (origin.correction is None or goal.duration is not None)
        return plan(primitive, request, self._config.tick, warm, remedy)
