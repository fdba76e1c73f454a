"""The simulated arm on its bus: the robot side's loop with the requests of a simulation, and the clock `stepped`."""

import logging
import threading
import time
from collections.abc import Sequence

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.pending_query import PendingQuery
from protocol.codec import bad_message
from protocol.errors import Refusal
from robot.description import RobotConfig
from services.common.other_robots import OtherRobots
from services.common.robot_side.clocks import IDLE_S, step_all
from services.common.robot_side.controller_presence import HANG_S
from services.common.robot_side.deferred import DeferredReply
from services.common.robot_side.loop import RobotLoop
from services.sim.arm import SimulatedArm
from services.sim.disturbances import Loss
from services.sim.world import World

MAX_STEPS = 10_000
SURROUNDINGS_HZ = 50


class SimLoop(RobotLoop):
    """Adds steps, resets, disturbances, lost messages, contacts and the ball."""

    def __init__(
        self, bus: Bus, config: RobotConfig, clock: m.Clock, seed: int, log: logging.Logger, world: World | None = None
    ) -> None:
        """`world`: world that the arm shares with others of this process; by default a new one."""
        world = world or World([config])
        self._arm = SimulatedArm(config, seed, world)
        self._loss = Loss(config.rate_hz)
        self._acting: list[m.ActiveDisturbance] = []
        self._surroundings_every = max(1, round(config.rate_hz / SURROUNDINGS_HZ))
        self.target = 0
        """With the stepped clock: tick up to which steps were requested."""
        super().__init__(bus, config, self._arm, clock, log, self._run_name(clock, seed))
        self._ball = self.publisher(topics.BALL)
        self._contact = self.publisher(topics.CONTACT)
        self._surroundings = self.publisher(topics.SCENE)
        self._disturbance = self.publisher(topics.DISTURBANCE)
        led = {name: joints for name, joints in config.others.items() if world.joints.isdisjoint(joints)}
        self._others = OtherRobots(bus, led)
        self._warn(log)
        self.handlers |= {
            topics.SIM_STEP.key: self._step_later,
            topics.SIM_RESET.key: self._reset,
            topics.SIM_DISTURB.key: self._disturb,
            topics.SIM_BALL.key: self._throw,
        }

    def _warn(self, log: logging.Logger) -> None:
        """Log the faults of the robot."""
        for finding in self._arm.check():
            if finding.level != "note":
                log.log(logging.ERROR if finding.level == "unusable" else logging.WARNING, "%s", finding.sentence)

    def loses(self, stream: str, tick: int) -> bool:
        """Return whether a disturbance of kind `loss` drops the message of `tick` on `stream`."""
        return self._loss.has(stream, tick)

    def publish(self) -> None:
        """Publish the tick's state, contacts, ball, other moving joints, and disturbances."""
        super().publish()
        for joints, state in self._others.take():
            self._arm.lead(joints, state.positions, state.velocities)
        now = self._arm.observe()
        for contact in self._arm.contacts():
            self._contact.put(contact)
        for sight in self._arm.sights():
            self._ball.put(sight)
        surroundings = self._arm.surroundings() if now.tick % self._surroundings_every == 0 else None
        if surroundings:
            self._surroundings.put(m.Scene(time=now.time, joints=surroundings))
        acting = self._arm.disturbances() + self._loss.describe(now.tick)
        if acting != self._acting:
            self._acting = acting
            self._disturbance.put(m.Disturbance(time=now.time, active=acting))

    @property
    def left(self) -> int:
        """With the stepped clock: number of requested ticks that remain."""
        return self.target - self._arm.observe().tick

    def begin_run(self, run: int | None = None) -> None:
        """Start a run without message loss; with the stepped clock its number does not depend on the time of day."""
        super().begin_run(self.drive.run + 1 if run is None and self.clock == "stepped" else run)
        self._loss.clear()
        self.target = 0

    # --- requests -------------------------------------------------------------------------------------

    def _step_later(self, query: PendingQuery, request: m.Step) -> None:
        if self.clock != "stepped":
            raise Refusal("wrong_clock", f"sim/step needs the clock stepped; this arm's is {self.clock}")
        if not 1 <= request.ticks <= MAX_STEPS:
            raise bad_message("ticks", f"ticks is {request.ticks}; 1 to {MAX_STEPS} can be stepped at once")
        self.refuse_while_deferring()
        self.target = self._arm.observe().tick + request.ticks
        self.deferred = DeferredReply(
            query, self._has_stepped, self._stepped, time.monotonic() + HANG_S, refuse=self._not_stepped
        )

    def _has_stepped(self) -> bool:
        """Whether the last requested tick has passed and was answered, so that all processes are at the same tick."""
        return self._arm.observe().tick >= self.target and self.is_answered(self.target)

    def _stepped(self) -> m.Stepped:
        now = self._arm.observe()
        return m.Stepped(tick=now.tick, time=now.time)

    def _not_stepped(self) -> Refusal:
        """Drop the remaining steps."""
        tick = self._arm.observe().tick
        left, self.target = self.target - tick, tick
        sentence = f"the controller did not answer tick {tick} within {HANG_S} s; {left} ticks are left"
        return Refusal("unavailable", sentence, service="controller", tick=tick)

    def _reset(self, query: PendingQuery, request: m.Reset) -> None:
        self.refuse_while_deferring()
        self._arm.reset(request.positions, request.ball, request.seed)
        controlled = self.drive.answered_tick >= 0
        self.begin_run(self._run_name(self.clock, request.seed))
        self.publish()
        done = m.ResetDone(tick=0, time=0.0, run=self.drive.run)
        patience = HANG_S if controlled else 0.0
        self.deferred = DeferredReply(query, lambda: self.is_answered(0), lambda: done, time.monotonic() + patience)

    def _disturb(self, query: PendingQuery, request: m.Disturb) -> None:
        begins = self._lose(request) if request.kind == "loss" else self._arm.disturb(request)
        query.reply(m.Disturbed(start_time=begins))

    def _throw(self, query: PendingQuery, request: m.Throw) -> None:
        query.reply(m.Thrown(time=self._arm.throw(request)))

    def _lose(self, request: m.Disturb) -> float:
        tick = self._arm.observe().tick + 1
        self._loss.begin(request, tick)
        return tick / self.config.rate_hz

    @staticmethod
    def _run_name(clock: m.Clock, seed: int) -> int | None:
        """Return the run's number: the seed with the stepped clock, else None, for the time of its start."""
        return seed if clock == "stepped" else None


def run_stepped(loops: Sequence[SimLoop], stopping: threading.Event) -> None:
    """Run with steps on request, each after the answer to the present tick, until `stopping` is set."""
    while not stopping.is_set():
        asked = next((loop for loop in loops if loop.deferred is not None), None)
        late = [loop for loop in loops if not _is_answered(loop, asked)]
        if asked is not None and asked.deferred is not None and asked.left > 0 and not late:
            step_all(loops)
            asked.deferred.deadline = time.monotonic() + HANG_S
        else:
            for loop in late or loops:
                if (taken := loop.commands.take(IDLE_S if asked else 0.0)) is not None:
                    loop.receive(taken)
        for loop in loops:
            loop.attend(0.0 if asked else IDLE_S)


def _is_answered(loop: SimLoop, asked: SimLoop | None) -> bool:
    """Return whether the present tick is answered; other arms than the requested one may have no controller."""
    return loop.is_answered(loop.backend.observe().tick) or (loop is not asked and loop.drive.answered_tick < 0)
