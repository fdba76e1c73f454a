"""The simulated arm on its bus: by the wall clock, in lock-step at its pace, or step by step."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus, PendingQuery
from protocol.bus.queues import Inbox, Stream
from protocol.codec import bad_message, decode
from protocol.errors import Refusal
from robot.conversions import finite_or_null, ranges_or_null
from robot.description import RobotConfig
from services.common.logs import ThrottledLog
from services.common.puts import PutWatch
from services.common.realtime import Deadlines
from services.sim.arm import SimulatedArm
from services.sim.drive import Drive, Loss
from services.sim.pace import HANG_S, Pace, Partner

PATIENCE_S = 2.0
IDLE_S = 0.02
MAX_STEPS = 10_000
BALL_EVERY = 10
HEAD_START_NS = 300_000
"""Time for a step, which takes 0.1 to 0.2 ms, and for a late wake-up."""


@dataclass(slots=True)
class Debt:
    """A step or reset to be answered once the controller has answered tick `target`, or `deadline` has passed.

    `strict`: past the deadline it is refused, otherwise answered all the same.
    """

    asking: PendingQuery
    answer: Callable[[], Any]
    target: int
    deadline: float
    strict: bool


class SimLoop:
    """Owns the arm; requests and commands come through queues."""

    def __init__(self, bus: Bus, config: RobotConfig, clock: m.Clock, seed: int, log: logging.Logger) -> None:
        self._config = config
        self._clock: m.Clock = clock
        self._stepped = clock == "stepped"
        self._log = log
        self._refusals, self._stalls = ThrottledLog(log), ThrottledLog(log)
        self._bus = bus
        self._puts = PutWatch(bus, log)
        self._arm = SimulatedArm(config, seed)
        self._drive = Drive(config)
        self._loss = Loss(config.rate_hz)
        self._commands = Stream()
        self._requests: Inbox[PendingQuery] = Inbox(wake=self._commands.wake if clock == "paced" else None)
        self._controller = Partner(wake=self._commands.wake)
        self._debt: Debt | None = None
        self._acting: list[m.ActiveDisturbance] = []
        blocking = clock != "realtime"
        self._state = bus.publisher(topics.STATE, blocking)
        self._ball = bus.publisher(topics.BALL, blocking)
        self._contact = bus.publisher(topics.CONTACT, blocking)
        self._disturbance = bus.publisher(topics.DISTURBANCE, blocking)
        self._handlers: dict[str, Callable[[Any], Any]] = {
            topics.STATE_QUERY.key: lambda _: self._state_message(),
            topics.DESCRIPTION.key: lambda _: self._description(),
            topics.SIM_DISTURB.key: self._disturb,
        }
        self._drive.begin(seed if self._stepped else time.time_ns(), self._arm.observe().true_positions)

    def open(self) -> None:
        """Declare everything on the bus and publish tick 0."""
        self._bus.stream(topics.COMMAND, self._commands)
        if self._clock == "paced":
            self._bus.watch_alive(topics.alive_key("controller"), self._controller.see)
        for query in topics.QUERIES:
            if query.owner == "sim":
                self._bus.serve(query, self._requests)
        self._publish()
        self._bus.announce("sim")

    def run(self, stopping: threading.Event) -> None:
        """Let time pass until `stopping` is set."""
        runs = {"stepped": self._run_stepped, "paced": self._run_paced, "realtime": self._run_realtime}
        runs[self._clock](stopping)

    def _run_realtime(self, stopping: threading.Event) -> None:
        """At each deadline take the newest command, step, publish.

        A step whose command is there is taken a little ahead, so that the state comes out at the deadline and the
        controller has the whole tick for its answer.
        """
        deadlines = Deadlines(round(1e9 / self._config.rate_hz))
        while not stopping.is_set():
            stalls = deadlines.stalls
            deadlines.near(HEAD_START_NS)
            ahead = self._step_if_answered()
            deadlines.wait()
            if deadlines.stalls > stalls:
                self._stalls.warn(f"the machine stalled; robot time lags by {deadlines.lag_ns * 1e-9:.3f} s in all")
            if not ahead:
                self._hear_all()
                self._step()
            self._publish()
            self._attend(self._requests.take())
            self._pay()

    def _run_paced(self, stopping: threading.Event) -> None:
        """Step once the present tick's time is over and, where there is a controller, it has answered."""
        pace = Pace(self._config.rate_hz, self._log)
        while not stopping.is_set():
            tick = self._arm.observe().tick
            if self._is_answered(tick) or not self._controller.is_awaited:
                pace.wait()
                self._hear_all()
                self._step()
                self._publish()
            elif (taken := self._commands.take(IDLE_S)) is not None:
                self._hear(taken)
            elif self._controller.starts_to_hang():
                self._log.warning("the controller has not answered tick %d for %g s; time goes on", tick, HANG_S)
                pace.restart()
            self._attend(self._requests.take())
            self._pay()

    def _run_stepped(self, stopping: threading.Event) -> None:
        """Step only while a request asks for it, and only once the present tick is answered."""
        while not stopping.is_set():
            debt = self._debt
            tick = self._arm.observe().tick
            if debt and tick < debt.target and self._is_answered(tick):
                self._step()
                self._publish()
                debt.deadline = time.monotonic() + PATIENCE_S
            elif (taken := self._commands.take(IDLE_S if debt else 0.0)) is not None:
                self._hear(taken)
            self._attend(self._requests.take(0.0 if debt else IDLE_S))
            self._pay()

    # --- the three verbs ------------------------------------------------------------------------------

    def _hear(self, data: bytes) -> None:
        """Take a command in, unless it is malformed, old, or lost by request."""
        tick = self._arm.observe().tick
        try:
            command = decode(data, m.Command)
            self._drive.take(command, tick)
        except Refusal as refusal:
            self._refusals.warn(f"a command was refused: {refusal}", refusal.code)
            return
        self._controller.hear()
        if self._loss.has("command", command.tick):
            self._drive.lose()

    def _hear_all(self) -> None:
        while (taken := self._commands.take()) is not None:
            self._hear(taken)

    def _step_if_answered(self) -> bool:
        self._hear_all()
        answered = self._drive.answered_tick == self._arm.observe().tick
        if answered:
            self._step()
        return answered

    def _step(self) -> None:
        now = self._arm.observe()
        self._arm.step(self._drive.acceleration(now.positions, now.velocities))

    def _publish(self) -> None:
        """Say what the tick brought."""
        now = self._arm.observe()
        if not self._loss.has("state", now.tick):
            self._state.put(self._state_message())
        self._controller.ask()
        for contact in self._arm.contacts():
            self._contact.put(contact)
        ball = self._arm.ball() if now.tick % BALL_EVERY == 0 else None
        if ball is not None:
            self._ball.put(m.BallState(time=now.time, position=ball[0].tolist(), velocity=ball[1].tolist()))
        acting = self._arm.disturbances() + self._loss.describe(now.tick)
        if acting != self._acting:
            self._acting = acting
            self._disturbance.put(m.Disturbance(time=now.time, active=acting))

    # --- requests -------------------------------------------------------------------------------------

    def _attend(self, asking: PendingQuery | None) -> None:
        """Answer a request, or take on the debt of answering it later."""
        if asking is None:
            self._puts.look()
            return
        try:
            if asking.topic is topics.SIM_STEP:
                self._owe_steps(asking)
            elif asking.topic is topics.SIM_RESET:
                self._owe_reset(asking)
            else:
                asking.reply(self._handlers[asking.topic.key](asking.decode()))
        except Refusal as refusal:
            asking.refuse(refusal)

    def _pay(self) -> None:
        """Answer the step or reset that was owed, once it is done or patience is over."""
        debt = self._debt
        if debt is None:
            return
        now = self._arm.observe()
        if now.tick >= debt.target and self._is_answered(debt.target):
            debt.asking.reply(debt.answer())
        elif time.monotonic() > debt.deadline:
            if debt.strict:
                left = debt.target - now.tick
                sentence = f"the controller did not answer tick {now.tick} within {PATIENCE_S} s; {left} ticks are left"
                debt.asking.refuse(Refusal("unavailable", sentence, service="controller", tick=now.tick))
            else:
                debt.asking.reply(debt.answer())
        else:
            return
        self._debt = None

    def _is_answered(self, tick: int) -> bool:
        """Whether the controller has answered `tick`, or cannot have seen it."""
        return self._drive.answered_tick >= tick or self._loss.has("state", tick)

    def _owe_steps(self, asking: PendingQuery) -> None:
        request = asking.decode()
        if not self._stepped:
            raise Refusal("wrong_clock", f"sim/step needs the clock stepped; this arm's is {self._clock}")
        if not 1 <= request.ticks <= MAX_STEPS:
            raise bad_message("ticks", f"ticks is {request.ticks}; 1 to {MAX_STEPS} can be stepped at once")
        self._refuse_while_owing()
        deadline = time.monotonic() + PATIENCE_S
        target = self._arm.observe().tick + request.ticks
        self._debt = Debt(asking, self._stepped_message, target, deadline, strict=True)

    def _stepped_message(self) -> m.Stepped:
        now = self._arm.observe()
        return m.Stepped(tick=now.tick, time=now.time)

    def _owe_reset(self, asking: PendingQuery) -> None:
        request = asking.decode()
        self._refuse_while_owing()
        self._arm.reset(request.positions, request.ball, request.seed)
        controlled = self._drive.answered_tick >= 0
        self._drive.begin(request.seed if self._stepped else time.time_ns(), self._arm.observe().true_positions)
        self._loss.clear()
        self._publish()
        done = m.ResetDone(tick=0, time=0.0, run=self._drive.run)
        patience = PATIENCE_S if controlled else 0.0
        self._debt = Debt(asking, lambda: done, 0, time.monotonic() + patience, strict=False)

    def _refuse_while_owing(self) -> None:
        if self._debt is not None:
            raise Refusal("busy", "a step or reset is under way; wait for its answer", goal_id=None)

    def _disturb(self, request: m.Disturb) -> m.Disturbed:
        if request.kind != "loss":
            return m.Disturbed(start_time=self._arm.disturb(request))
        if request.stream is None:
            raise bad_message("stream", "stream is missing; say whether 'state' or 'command' messages are lost")
        if request.duration is None or not 0 < request.duration <= 3600:
            raise bad_message("duration", f"duration is {request.duration}; a loss lasts between 0 and 3600 s")
        if request.start_time is not None:
            raise bad_message("start_time", "a loss begins at once; leave start_time null")
        tick = self._arm.observe().tick + 1
        self._loss.begin(request.stream, request.duration, tick)
        return m.Disturbed(start_time=tick / self._config.rate_hz)

    # --- messages -------------------------------------------------------------------------------------

    def _state_message(self) -> m.State:
        now = self._arm.observe()
        return m.State(
            run=self._drive.run,
            tick=now.tick,
            time=now.time,
            positions=now.positions.tolist(),
            velocities=now.velocities.tolist(),
            torques=now.torques.tolist(),
            saturated=now.saturated.tolist(),
            brake=self._drive.brake,
            applied_tick=self._drive.applied_tick,
            truth=m.Point(positions=now.true_positions.tolist(), velocities=now.true_velocities.tolist()),
        )

    def _description(self) -> m.Description:
        limits = self._config.limits
        return m.Description(
            joint_names=list(self._config.joint_names),
            home=self._config.home.tolist(),
            limits=m.RobotLimits(
                positions=ranges_or_null(limits.positions),
                velocities=finite_or_null(limits.velocities),
                accelerations=finite_or_null(limits.accelerations),
                jerks=finite_or_null(limits.jerks),
                torques=finite_or_null(self._config.torques),
            ),
            rate_hz=self._config.rate_hz,
            clock=self._clock,
            run=self._drive.run,
        )
