"""The planner's requests: primitives, forget, goal."""

import logging
import time
from collections import deque
from collections.abc import Callable
from functools import partial

import numpy as np

from motion.dmp_plan import DmpPlan, check_limits, plan_dmp
from motion.errors import MotionError
from motion.plan import Plan, Warm, plan
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest
from protocol import messages as m
from protocol import topics
from protocol.bus import Bus, Publisher
from protocol.errors import NoAnswer, Refusal
from protocol.topics import MAX_PLAN_S
from services.planner.answers import Answers
from services.planner.goals import (
    Origin,
    check_goal,
    motion_request,
    not_executed,
    refusal_of,
    start_boundary,
    too_long,
)
from services.planner.library import Library, Written
from services.planner.rehearsal import rehearse
from services.planner.replies import goal_reply, plan_message, refused_message, trajectory_message
from services.robot import RobotConfig

STEPPED_LEAD_TICKS = 20
UNKNOWN_PLANNING_S = 0.025


class Lead:
    """How far ahead a plan begins: what nine in ten of the last plans took, and two ticks.

    Of what a plan took, the reference's way here and the acceptance's way back (2 ms) need no lead, so of the tenth
    plan few are late. A late one moves nothing, and is planned again with the lead of the slowest, at least twice what
    itself took. Before anything was measured, and for the first ten plans, 25 ms count as one that was. `fixed` (s)
    overrides. In stepped time nothing is late, and the lead is 20 ticks.
    """

    def __init__(self, tick: float, fixed: float | None = None) -> None:
        self.stepped = False
        self._stepped_lead = STEPPED_LEAD_TICKS * tick
        self._fixed = fixed
        self._margin = 2 * tick
        self._took: deque[float] = deque([UNKNOWN_PLANNING_S], maxlen=50)

    def seconds(self, again: bool = False) -> float:
        """Return the lead of the next plan; `again` after one that came late."""
        if self.stepped:
            return self._stepped_lead
        if self._fixed is not None:
            return self._fixed
        took = sorted(self._took)
        if again:
            return self._margin + max(took[-1], 2 * self._took[-1])
        return self._margin + took[9 * len(took) // 10]

    def note(self, seconds: float) -> None:
        """Note what a plan took from its reference to its acceptance or refusal."""
        self._took.append(seconds)


class Planner:
    """Answers the planner's requests, one at a time; asks the controller where to begin and to play the result."""

    def __init__(self, bus: Bus, config: RobotConfig, library: Library, lead: Lead, log: logging.Logger) -> None:
        self._bus = bus
        self._config = config
        self._library = library
        self._lead = lead
        self._log = log
        self._plans: Publisher[m.Plan] = bus.publisher(topics.PLAN, blocking=True)
        self._refused: Publisher[m.Refused] = bus.publisher(topics.REFUSED)
        self._warm: dict[str, Warm] = {}
        self._answers = Answers()

    def warm_up(self) -> None:
        """Plan and encode some motions that limits shape, so that the first goal finds everything built and loaded."""
        for described in self._library:
            primitive = self._library.get(described.name)
            if primitive.joint_count != self._config.joint_count:
                continue
            try:
                rehearse(primitive, self._config)
            except MotionError as error:
                self._log.info("no warm-up with %s: %s", described.name, error)
            return

    def primitives(self, _: m.Empty) -> m.Primitives:
        """List the library."""
        return m.Primitives(primitives=list(self._library))

    def keep(self, written: Written, replace: bool) -> None:
        """Take a primitive that was learned and written into the library.

        Raises:
            Refusal: another of its name was learned meanwhile and `replace` is not asked for; the library is full, or
                cannot be written.
        """
        self._library.check_name(written.name, replace)
        self._library.keep(written)
        self._warm.pop(written.name, None)

    def forget(self, request: m.Forget) -> m.Forgotten:
        """Remove a primitive; a motion made from it goes on."""
        self._library.remove(request.name)
        self._warm.pop(request.name, None)
        return m.Forgotten(name=request.name)

    def goal(self, goal: m.Goal, goal_id: str, requested_ns: int, reply: Callable[[m.GoalReply], object]) -> None:
        """Plan `goal` and, unless it is plan-only, have it played as `goal_id`, its own or one made for it.

        The answer goes to `reply`, and only then what is played is published: whoever listens to it does not hold up
        the answer.

        Raises:
            Refusal: whatever stands in its way; then nothing moves, except that `unavailable` with a goal_id leaves
                open whether it does.
        """
        known = self._answers.find(goal)
        if known is not None:
            reply(known)
            return
        primitive = self._library.get(goal.primitive)
        check_goal(goal, primitive, self._config)
        if goal.plan_only:
            answer, played = self._only_plan(goal, goal_id, primitive, requested_ns), None
        else:
            answer, played = self._play(goal, goal_id, primitive, requested_ns)
        self._answers.keep(goal, answer)
        reply(answer)
        if played is not None:
            self._plans.put(played())

    def tell_refused(self, goal: m.Goal | None, goal_id: str | None, refusal: Refusal, requested_ns: int) -> None:
        """Publish a refusal that was answered; `goal` and its id are None where its body did not decode."""
        self._refused.put(refused_message(goal, goal_id, refusal, requested_ns))

    def _only_plan(self, goal: m.Goal, goal_id: str, primitive: Primitive, requested_ns: int) -> m.GoalReply:
        """Plan; sampled only where the samples are asked for.

        What has its own start and takes its time whenever it begins is planned while the controller is asked.
        """
        answer = self._ask_reference(again=False)
        at_once = goal.start is not None and goal.arrival_time is None
        solved = self._solve(goal, primitive, self._origin(goal, None)) if at_once else None
        origin = self._origin(goal, self._reference(answer, optional=True))
        made, solve_ms = solved or self._solve(goal, primitive, origin)
        trajectory = None
        if goal.include_trajectory:
            stamps = m.Stamps(requested=requested_ns, planned=time.time_ns())
            trajectory = trajectory_message(made, goal, goal_id, origin, self._config, stamps)
        return goal_reply(made, goal_id, origin.time, trajectory, solve_ms, self._config)

    def _play(
        self, goal: m.Goal, goal_id: str, primitive: Primitive, requested_ns: int
    ) -> tuple[m.GoalReply, Callable[[], m.Plan]]:
        """Plan and execute; once more where the plan came late or another plan came between."""
        for last in (False, True):
            began = time.monotonic()
            origin = self._origin(goal, self._reference(self._ask_reference(again=last), optional=False))
            made, solve_ms = self._solve(goal, primitive, origin)
            stamps = m.Stamps(requested=requested_ns, planned=time.time_ns())
            trajectory = trajectory_message(made, goal, goal_id, origin, self._config, stamps)
            try:
                self._execute(trajectory)
            except Refusal as refusal:
                overtaken = refusal.code == "superseded" and refusal.detail.get("cause") == "plan"
                if last or not (refusal.code == "late" or overtaken):
                    raise
                self._log.warning("goal %s: %s", goal_id, refusal, extra={"goal_id": goal_id, "code": refusal.code})
                continue
            finally:
                self._lead.note(time.monotonic() - began)
            solved = goal_id, goal.primitive, made.duration, solve_ms
            self._log.info("goal %s: %s, %.3f s, solved in %.1f ms", *solved, extra={"goal_id": goal_id})
            included = trajectory if goal.include_trajectory else None
            answer = goal_reply(made, goal_id, origin.time, included, solve_ms, self._config)
            return answer, partial(plan_message, made, trajectory, goal, primitive)
        raise AssertionError("unreachable: the last round returns or raises")

    def _solve(self, goal: m.Goal, primitive: Primitive, origin: Origin) -> tuple[Plan | DmpPlan, float]:
        request = motion_request(goal, primitive, self._config, origin)
        began = time.perf_counter()
        try:
            made = self._planned(goal, primitive, request)
        except MotionError as error:
            raise refusal_of(error, self._config) from None
        if made.total_duration > MAX_PLAN_S + self._config.tick / 2:
            raise too_long(goal, made.duration, made.total_duration)
        return made, (time.perf_counter() - began) * 1e3

    def _planned(self, goal: m.Goal, primitive: Primitive, request: MotionRequest) -> Plan | DmpPlan:
        """By the method asked for. A DMP's plan may leave the limits, which only a plan-only goal allows."""
        if goal.method == "dmp":
            rolled_out = plan_dmp(primitive, request, self._config.tick)
            if not goal.plan_only:
                check_limits(rolled_out)
            return rolled_out
        made = plan(primitive, request, self._config.tick, self._warm.get(goal.primitive))
        self._warm[goal.primitive] = made.warm
        return made

    def _origin(self, goal: m.Goal, reference: m.Reference | None) -> Origin:
        """Where the motion begins: the goal's own start, the reference's future, or the home pose at rest."""
        at, epoch = (reference.time, reference.epoch) if reference else (0.0, 0)
        if goal.start is not None:
            return Origin(at, epoch, start_boundary(goal.start, self._config))
        if reference is None:
            rest = np.zeros(self._config.joint_count)
            return Origin(at, epoch, Boundary(self._config.home, rest, rest))
        vectors = (np.array(v) for v in (reference.positions, reference.velocities, reference.accelerations))
        return Origin(at, epoch, Boundary(*vectors))

    def _ask_reference(self, again: bool) -> Callable[[], m.Reference]:
        return self._bus.send(topics.REFERENCE, m.ReferenceRequest(lead=self._lead.seconds(again)))

    def _reference(self, answer: Callable[[], m.Reference], optional: bool) -> m.Reference | None:
        try:
            return answer()
        except NoAnswer as silence:
            if optional:
                return None
            raise Refusal("unavailable", f"{silence}; start it first", service="controller") from None
        except Refusal as refusal:
            if optional and refusal.code == "unavailable":
                return None
            raise

    def _execute(self, trajectory: m.Trajectory) -> None:
        try:
            self._bus.ask(topics.EXECUTE, trajectory)
        except NoAnswer as silence:
            sentence = f"{silence}; goal {trajectory.goal_id} may have started, ask `result`"
            raise Refusal("unavailable", sentence, service="controller", goal_id=trajectory.goal_id) from None
        except Refusal as refusal:
            if refusal.code == "bad_message":  # of the plan, not of the goal that it was made for
                raise not_executed(refusal) from None
            raise
