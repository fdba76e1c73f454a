"""The controller without its bus: answers each state with a command, and requests between ticks."""

from collections.abc import Container

import numpy as np

from protocol import messages as m
from protocol.codec import bad_message, check_id
from protocol.errors import Refusal
from protocol.topics import MAX_PLAN_S
from robot.description import RobotConfig
from services.common.ticks import ticks_ahead
from services.controller.checks import Checked, check_continuity
from services.controller.commands import CommandMaker
from services.controller.conditions import ArmCondition
from services.controller.incidents import lost_track
from services.controller.ledger import Ledger, active_goal, error_of
from services.controller.loop_statistics import LoopStatistics
from services.controller.modes import Event, Mode, next_mode
from services.controller.recoil import RecoilWatch
from services.controller.states import States, speed_of
from services.controller.timeline import Timeline

AT_REST = 0.05
"""Measured speed (rad/s) below which the arm counts as at rest."""

RESETTABLE: tuple[m.Condition, ...] = "ready", "braking"
RECOVER = "send `recover` to the arm first"
"""Conditions in which `reset` leaves a fault, and the cure in all others."""


class Controller:
    """Tracks the reference trajectory by eq. 11, and keeps its goals.

    Time is the tick of the newest state; Unix times are arguments named `now_ns`. Before the first state, every request
    is refused as `unavailable`.
    """

    def __init__(self, config: RobotConfig) -> None:
        self.config = config
        self.states = States(config.joint_count, config.silence_ticks)
        self.statistics = LoopStatistics()
        self.ledger = Ledger()
        self.mode = Mode.HOLDING
        self.epoch = 0
        self._broken_epoch = 0
        self.fault: str | None = None
        self.changed = False
        self._timeline = Timeline(config.home, config.limits, config.tick)
        self._condition = ArmCondition()
        self._recoil = RecoilWatch(config)
        self._commands = CommandMaker(config)

    def meet(self, arm: m.Description) -> None:
        """Take the clock from the arm's description."""
        self.states.stepped, self.states.realtime = arm.clock == "stepped", arm.clock == "realtime"
        self._commands.delay_ticks = arm.delay_ticks

    @property
    def resting(self) -> bool:
        """Whether the reference is at rest for good."""
        state = self.states.newest
        return state is None or state.tick >= self._timeline.end

    # --- every tick -----------------------------------------------------------------------------------

    def answer(self, state: m.State, now_ns: int) -> m.Command | None:
        """Return the command that answers `state`, or None for an old, duplicate or malformed state."""
        if not self.states.admits(state):
            if self.states.repeats(state):
                self._note_condition(state)
            return None
        if self.states.opens_run(state):
            if self.states.must_wait(state):
                return None
            self._begin_run(state)
        else:
            self.statistics.note_state(state.tick, state.applied_tick + self._commands.delay_ticks)
        self.states.take(state)
        self._note_condition(state)
        self._timeline.forget_before(state.tick)
        positions, velocities = np.array(state.positions), np.array(state.velocities)
        self._follow_goals(state, positions, velocities, now_ns)
        goal = self.ledger.current(state.tick)
        return self._commands.make(state, self._timeline, goal.result.goal_id if goal else None, self._recoil.active)

    def raise_fault(self, reason: str, hold: bool = False) -> None:
        """Latch a fault and end all goals; stop under control or, if `hold`, stay at the measured pose."""
        self._switch(Event.FAULT)
        self._break_epoch()
        self.fault = reason
        self._recoil.clear()
        self.ledger.close_all("aborted", reason)
        if hold and (state := self.states.newest) is not None:
            self._timeline.hold(np.array(state.positions), state.tick)
        else:
            self._stop_soon()

    # --- requests -------------------------------------------------------------------------------------

    def execute(self, checked: Checked, clients: Container[str], now_ns: int) -> m.Accepted:
        """Splice a checked trajectory into the reference; `clients` are those that hold their liveliness tokens.

        Raises:
            Refusal: `fault`, `duplicate`, `not_holder`, `busy`, `superseded`, `late`, or `invalid_goal` if it does
                not continue the reference.
        """
        trajectory, segment = checked.message, checked.segment
        goal_id = trajectory.goal_id
        self.states.require()
        if self.fault is not None:
            cure = "send `reset` once the arm is at rest" if self._condition.now in RESETTABLE else RECOVER
            sentence = f"the controller is in fault: {self.fault}; {cure}"
            raise Refusal("fault", sentence, fault=self.fault)
        self._condition.require("send this goal once the arm's condition is ready", "ready")
        self.ledger.admit(trajectory, clients)
        if trajectory.epoch != self.epoch:
            sentence = f"goal {goal_id} was planned in epoch {trajectory.epoch}, it is {self.epoch} now; plan again"
            cause = "plan" if self._broken_epoch <= trajectory.epoch < self.epoch else "break"
            raise Refusal("superseded", sentence, goal_id=goal_id, cause=cause)
        if segment.start < self._soonest:
            late = (self._soonest - segment.start) * self.config.tick
            sentence = f"goal {goal_id} starts at {trajectory.start_time} s, {late:.3f} s too late; use a longer lead"
            raise Refusal("late", sentence, goal_id=goal_id)
        self.ledger.check_room(segment, self.config)
        check_continuity(self._timeline.at(segment.start), segment, self.config)
        self._timeline.splice(segment)
        self._switch(Event.ACCEPT)
        self.epoch += 1
        self.ledger.open(active_goal(checked, self.config, now_ns))
        return m.Accepted(goal_id=goal_id, start_time=segment.start * self.config.tick)

    def reference(self, request: m.ReferenceRequest) -> m.Reference:
        """Return a point of the reference trajectory, with all motions accepted so far.

        Raises:
            Refusal: `bad_message` for a lead outside 0 … 60 s.
        """
        state = self.states.require()
        if not 0.0 <= request.lead <= MAX_PLAN_S:
            raise bad_message("lead", f"lead is {request.lead} s; it must lie between 0 and {MAX_PLAN_S} s")
        tick = state.tick + ticks_ahead(request.lead, self.config.rate_hz)
        positions, velocities, accelerations = (vector.tolist() for vector in self._timeline.at(tick))
        return m.Reference(
            time=tick * self.config.tick,
            epoch=self.epoch,
            positions=positions,
            velocities=velocities,
            accelerations=accelerations,
            goal_id=self.ledger.played_at(tick),
        )

    def cancel(self, request: m.Cancel) -> m.Canceled:
        """Stop at the first tick from which a jerk-limited stop stays inside all limits.

        Raises:
            Refusal: `unknown_goal`; `bad_message` for an id that no goal can have.
        """
        if request.goal_id is not None:
            check_id("goal_id", request.goal_id)
        state = self.states.require()
        newest = self.ledger.active[-1] if self.ledger.active else None
        rests = max(state.tick, self._timeline.end)
        if request.goal_id is not None and (newest is None or request.goal_id != newest.result.goal_id):
            if not self.ledger.knows(request.goal_id):
                self._break_epoch()  # its plan may still arrive, and must not move the arm
            self.ledger.result(request.goal_id)
            return m.Canceled(goal_id=None, stop_time=rests * self.config.tick)
        self._break_epoch()
        self.changed = True
        if newest is None:
            return m.Canceled(goal_id=None, stop_time=rests * self.config.tick)
        rests = self._halt("on request")
        return m.Canceled(goal_id=newest.result.goal_id, stop_time=rests * self.config.tick)

    def reset(self) -> m.ModeReply:
        """Leave a latched fault and hold the measured pose.

        Raises:
            Refusal: `fault` for an arm that must `recover` first; `busy` while the arm or its reference moves.
        """
        state = self.states.require()
        self._condition.require(RECOVER, *RESETTABLE)
        fastest = speed_of(state)
        if state.tick < self._timeline.end or (self.fault is not None and fastest > AT_REST):
            goal = self.ledger.current(state.tick)
            sentence = f"the arm moves ({fastest:.3f} rad/s); reset is for an arm at rest: cancel first, or wait"
            raise Refusal("busy", sentence, goal_id=goal.result.goal_id if goal else None)
        if self.fault is not None:
            self._timeline.hold(np.array(state.positions), state.tick)
            self._condition.expect_release(state.tick + self.config.silence_ticks)
            self.fault = None
        self._break_epoch()
        self._switch(Event.RESET)
        return m.ModeReply(mode=self.mode.value)

    def end_lease(self, client_id: str) -> None:
        """Cancel the motion for which `client_id` held a lease, if there is one."""
        if any(goal.lease and goal.client_id == client_id for goal in self.ledger.active):
            self._break_epoch()
            self._halt(f"client {client_id} lost its lease")

    def status(self) -> m.Status:
        """Return the status."""
        state = self.states.require()
        reference = self._timeline.at(state.tick)
        goal = self.ledger.current(state.tick)
        return m.Status(
            time=state.time,
            mode=self.mode.value,
            epoch=self.epoch,
            goal_id=goal.result.goal_id if goal else None,
            time_from_start=(state.tick - goal.start) * self.config.tick if goal else None,
            reference=m.Point(positions=reference[0].tolist(), velocities=reference[1].tolist()),
            feedback=m.Point(positions=state.positions, velocities=state.velocities),
            error=error_of(state, reference),
            cycle=self.statistics.message(),
            fault=self.fault,
        )

    # --- inside ---------------------------------------------------------------------------------------

    def _begin_run(self, state: m.State) -> None:
        """Start a run of the arm: end all goals, and stay where the arm is.

        An arm that moves, for example because its last controller was killed, is stopped inside its limits. The stop
        begins with the arm's acceleration, so that the commanded acceleration does not jump.
        """
        self.ledger.close_all("aborted", "the arm began a new run")
        self._timeline.give_way(state, state.accelerations, self._commands.delay_ticks)
        self.statistics.begin(state.tick)
        self._break_epoch()
        self.fault = None
        self._condition = ArmCondition()
        self._recoil.clear()
        self._switch(Event.RUN)
        if self._timeline.end > state.tick + self._commands.delay_ticks + 1:
            self._switch(Event.CANCEL)

    def _note_condition(self, state: m.State) -> None:
        """Fault if the arm stops following commands; then the reference follows the arm, which others may move."""
        broken = self._condition.update(state, in_fault=self.fault is not None)
        if broken:
            self.raise_fault(broken, hold=True)
        if self._condition.now not in RESETTABLE:
            self._timeline.give_way(state)

    def _follow_goals(self, state: m.State, positions: np.ndarray, velocities: np.ndarray, now_ns: int) -> None:
        """Update the running goal, end finished goals, and fault if the arm is too far from its reference."""
        reference = self._timeline.at(state.tick)
        errors = np.abs(positions - reference[0])
        goal = self.ledger.current(state.tick)
        if goal is not None:
            goal.follow(state, reference, float(errors.max()), now_ns)
        accepted = self._recoil.follow(goal, state.tick, errors, np.abs(velocities - reference[1]))
        in_window = self._recoil.in_window(state.tick)
        lost = None if accepted else lost_track(errors, goal and goal.result, self.config, in_window)
        self.changed |= self.ledger.close_due(state.tick)
        if not self.ledger.active and state.tick >= self._timeline.end:
            self._switch(Event.REST)
        if lost is not None:
            self._lose_track(state, lost)

    def _lose_track(self, state: m.State, reason: str) -> None:
        """Fault if the arm is too far from its reference.

        With `on_fault = "hold"` the reference restarts at the measured state, also in a fault, so that the arm does not
        keep pressing on an obstacle.
        """
        if self.fault is None:
            self.raise_fault(reason)
        if self.config.on_fault == "hold":
            self._timeline.give_way(state)

    def _halt(self, reason: str) -> int:
        """Cancel the motion; return the tick at which the arm rests."""
        self._switch(Event.CANCEL)
        leaves, rests = self._stop_soon()
        self.ledger.close_later(leaves, rests, "canceled", reason)
        return rests

    def _stop_soon(self) -> tuple[int, int]:
        """Splice the earliest stop; return the ticks at which it leaves the plan and from which the arm rests."""
        return self._timeline.stop(self._soonest)

    @property
    def _soonest(self) -> int:
        """The first tick whose reference is in no command yet: earlier changes would be jumps."""
        return self.states.require().tick + self._commands.delay_ticks + 1

    def _break_epoch(self) -> None:
        """Supersede all earlier plans, without a new plan."""
        self.epoch += 1
        self._broken_epoch = self.epoch

    def _switch(self, event: Event) -> None:
        mode = next_mode(self.mode, event)
        self.changed |= mode != self.mode
        self.mode = mode
