"""The planner without its bus: the requests primitives, forget and goal."""

import logging
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import count

from motion.errors import MotionError
from motion.primitive import Primitive
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus, Publisher
from protocol.errors import NoAnswer, Refusal
from robot.description import RobotConfig
from services.planner.corrections import Corrections
from services.planner.foresight import Foresight
from services.planner.goal_checks import check_goal
from services.planner.goals import Origin, origin_of
from services.planner.idempotency import ReplyCache
from services.planner.lead_time import LeadTime
from services.planner.library import Library, Written
from services.planner.messages import executed_message, goal_reply, plan_message, refused_message, sampled_message
from services.planner.refusals import not_executed
from services.planner.scene import Scene
from services.planner.solving import ELSEWHERE, Made, Solver, Steps, effort_of
from services.planner.warm_up import warm_up


class Planner:
    """Answers the planner's requests, one at a time; asks the controller for its reference, and to execute the plan."""

    def __init__(self, bus: Bus, config: RobotConfig, library: Library, lead: LeadTime, log: logging.Logger) -> None:
        self._bus = bus
        self._config = config
        self._library = library
        self._lead = lead
        self._log = log
        self._plans: Publisher[m.Plan] = bus.publisher(topics.PLAN, blocking=True)
        self._refused: Publisher[m.Refused] = bus.publisher(topics.REFUSED)
        self._solver = Solver(config)
        self._scene = Scene(bus, config, self._solver.motions)
        log.info(str(self._solver.motions.clearance))
        self._corrections = Corrections()
        self._foresight = Foresight(config)
        self.receive_status = self._foresight.receive
        self._replies = ReplyCache()
        self._turns = count(1)
        self._newest = 0

    def warm_up(self) -> None:
        """Plan and encode some motions with active limits, so that the first goal finds everything built and loaded."""
        self._solver.warm_up()
        for described in self._library:
            primitive = self._library.get(described.name)
            if primitive.joint_count != self._config.joint_count:
                continue
            try:
                made = warm_up(primitive, self._config)
                self._solver.motions.check(made.trajectory, made.total_duration)
            except MotionError as error:
                self._log.info("no warm-up with %s: %s", described.name, error)
            return

    def primitives(self, _: m.Empty) -> m.Primitives:
        """List the library."""
        return m.Primitives(primitives=list(self._library))

    def keep(self, written: Written, replace: bool) -> None:
        """Add a learned primitive, which is already written to disk, to the library.

        Raises:
            Refusal: another primitive of this name was learned meanwhile and `replace` is false; the library is full,
                or cannot be written.
        """
        self._library.check_name(written.name, replace)
        self._library.keep(written)
        self._solver.forget(written.name)

    def forget(self, request: m.Forget) -> m.Forgotten:
        """Remove a primitive; a running motion made from it continues."""
        self._library.remove(request.name)
        self._solver.forget(request.name)
        return m.Forgotten(name=request.name)

    def goal(
        self, goal: m.Goal, goal_id: str, requested_ns: int, reply: Callable[[m.GoalReply], object]
    ) -> Steps[None]:
        """Plan `goal` and, unless it is plan-only, execute it as `goal_id`, which is the goal's or a new one.

        The reply goes to `reply`. The plan is published afterwards, so that subscribers do not delay the reply.
        This generator yields when the loop may serve other requests: for a method that plans in the worker process,
        first None, to wait for its turn there, then each Task, and receives the task's plan or refusal.

        Raises:
            Refusal: the goal is refused and nothing moves. Exception: after `unavailable` the motion may have started,
                if the sentence says so.
        """
        known = self._replies.find(goal)
        if known is not None:
            reply(known)
            return
        primitive = self._library.playable(goal.primitive)
        check_goal(goal, primitive, self._config)
        self._scene.update()
        turn = next(self._turns)
        if goal.method in ELSEWHERE:
            yield None
        if goal.plan_only:
            answer, played = (yield from self._only_plan(goal, goal_id, primitive, requested_ns)), None
        else:
            answer, played = yield from self._play(goal, goal_id, primitive, requested_ns, turn)
        self._replies.keep(goal, answer)
        reply(answer)
        if played is not None:
            self._plans.put(played())

    def publish_refused(self, goal: m.Goal | None, goal_id: str | None, refusal: Refusal, requested_ns: int) -> None:
        """Publish a refusal that was sent as a reply; `goal` and its id are None if the body was not decoded."""
        self._refused.put(refused_message(goal, goal_id, refusal, requested_ns))

    def _only_plan(self, goal: m.Goal, goal_id: str, primitive: Primitive, requested_ns: int) -> Steps[m.GoalReply]:
        """Plan without executing; compute samples only if they are requested.

        A goal with its own start and a duration is planned while the controller's reply is pending.
        """
        answer = self._ask_reference(goal, again=False)
        at_once = goal.start is not None and goal.arrival_time is None
        solved = (yield from self._solver.solve(goal, primitive, self._origin(goal, None))) if at_once else None
        origin = self._origin(goal, self._reference(answer, optional=goal.revises is None))
        if solved is None:
            made = yield from self._solver.solve(goal, primitive, origin)
        else:
            made = replace(solved, origin=origin)
        trajectory = None
        if goal.include_trajectory:
            stamps = m.Stamps(requested=requested_ns, planned=time.time_ns())
            trajectory = sampled_message(made, goal, goal_id, self._config, stamps)
        return goal_reply(made, goal_id, trajectory, self._config)

    def _play(
        self, goal: m.Goal, goal_id: str, primitive: Primitive, requested_ns: int, turn: int
    ) -> Steps[tuple[m.GoalReply, Callable[[], m.Plan]]]:
        """Plan and execute; repeat once if the plan was late or superseded.

        A plan never replaces the plan of a newer goal.
        """
        for last in (False, True):
            self._check_newest(goal_id, turn)
            origin = self._origin(goal, self._reference_of(goal, again=last))
            began = time.monotonic()
            made = yield from self._solver.solve(goal, primitive, origin)
            self._check_newest(goal_id, turn)
            if self._scene.update():  # another robot started a motion during planning
                made = self._solver.checked(made, goal)
            stamps = m.Stamps(requested=requested_ns, planned=time.time_ns())
            try:
                self._execute(executed_message(made, goal, goal_id, self._config, stamps))
            except Refusal as refusal:
                self._foresight.forget()
                late = refusal.code == "late"
                if refusal.code != "unavailable":  # a timeout is no planning time
                    self._note_time(goal, began, late)
                overtaken = refusal.code == "superseded" and refusal.detail.get("cause") == "plan"
                if last or not (late or overtaken):
                    raise
                self._log.warning("goal %s: %s", goal_id, refusal, extra={"goal_id": goal_id, "code": refusal.code})
                continue
            self._note_time(goal, began)
            self._newest = turn
            self._note_played(goal, goal_id, made)
            sampled = partial(sampled_message, made, goal, goal_id, self._config, stamps)
            answer = goal_reply(made, goal_id, sampled() if goal.include_trajectory else None, self._config)
            return answer, partial(_published, made, answer.trajectory or sampled, goal, primitive)
        raise AssertionError("unreachable: the last round returns or raises")

    def _check_newest(self, goal_id: str, turn: int) -> None:
        """Raise Refusal, `superseded`, if a newer goal is already played."""
        if self._newest > turn:
            sentence = "a goal that came after this one was played while this one was planned; send it again"
            raise Refusal("superseded", sentence, goal_id=goal_id, cause="plan")

    def _note_time(self, goal: m.Goal, began: float, late: bool = False) -> None:
        """Store the time since `began`, monotonic s, in which a plan was made and answered."""
        self._lead.note((self._foresight.pace or 1.0) * (time.monotonic() - began), effort_of(goal), late)

    def _note_played(self, goal: m.Goal, goal_id: str, made: Made) -> None:
        """Store an accepted motion, for goals that correct it."""
        phase = made.plan.report.phase
        posture = made.plan.request.goal.positions.tolist()
        self._corrections.note(goal, goal_id, made.origin.time, made.plan.duration, phase, posture)
        self._foresight.note(goal_id, made.origin.time, made.origin.epoch, made.plan)
        what = f"corrects {goal.revises} at phase {phase:.3f}, " if goal.revises else ""
        solved = goal_id, goal.primitive, what, made.plan.duration, made.solve_ms
        self._log.info("goal %s: %s, %s%.3f s, solved in %.1f ms", *solved, extra={"goal_id": goal_id})

    def _origin(self, goal: m.Goal, reference: m.Reference | None) -> Origin:
        return origin_of(goal, reference, self._corrections, self._config)

    def _reference_of(self, goal: m.Goal, again: bool) -> m.Reference | None:
        """Return the reference at the goal's start; for a correction, a point of the corrected motion.

        If it can be predicted, the controller is asked only `again`, after a plan that was late or superseded.
        """
        if goal.revises is not None and not again and not self._lead.stepped:
            foreseen = self._foresight.reference(self._lead.seconds(kind=effort_of(goal)))
            if foreseen is not None:
                return foreseen
        reference = self._reference(self._ask_reference(goal, again), optional=False)
        ahead = self._corrections.until_begin(goal, reference) if reference else 0.0
        return self._reference(self._ask_reference(goal, again, ahead), optional=False) if ahead > 0 else reference

    def _ask_reference(self, goal: m.Goal, again: bool, ahead: float = 0.0) -> Callable[[], m.Reference]:
        can_wait = goal.arrival_time is None and goal.revises is None
        lead = self._lead.seconds(again, effort_of(goal), can_wait) + ahead
        return self._bus.send(topics.REFERENCE, m.ReferenceRequest(lead=lead))

    def _reference(self, answer: Callable[[], m.Reference], optional: bool) -> m.Reference | None:
        try:
            return answer()
        except NoAnswer as silence:
            if optional:
                return None
            raise Refusal("unavailable", str(silence), service="controller") from None
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


def _published(
    made: Made, trajectory: m.Trajectory | Callable[[], m.Trajectory], goal: m.Goal, primitive: Primitive
) -> m.Plan:
    """Return the plan to publish; sample it now if the reply had no samples."""
    return plan_message(made, trajectory() if callable(trajectory) else trajectory, goal, primitive)
