"""The robot side on its bus: the loop's steps, which `clocks` calls, and its requests."""

import logging
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus, Publisher
from protocol.bus.pending_query import PendingQuery
from protocol.bus.queues import Inbox, Stream
from protocol.codec import decode
from protocol.errors import Refusal
from robot.description import RobotConfig
from services.common.logs import ThrottledLog
from services.common.robot_side.backend import Backend
from services.common.robot_side.controller_presence import ControllerPresence
from services.common.robot_side.deferred import DeferredReply
from services.common.robot_side.drive import NEVER, Drive
from services.common.robot_side.messages import description, state_message
from services.common.stray_puts import StrayPuts

AT_REST = 0.05
"""Speed (rad/s) below which the arm counts as at rest."""
RECOVERY_S = 25.0
"""Timeout of a robot's recovery."""


class RobotLoop:
    """Owns a robot; requests and commands arrive in queues.

    A subclass for a kind of robot adds requests to `handlers`, before `open`, and publications to `publish`.
    """

    def __init__(
        self,
        bus: Bus,
        config: RobotConfig,
        backend: Backend,
        clock: m.Clock,
        log: logging.Logger,
        run: int | None = None,
    ) -> None:
        """`run` is the number of the first run; by default the time, in Unix ns."""
        self.config = config
        self.clock: m.Clock = clock
        self.log = log
        self.backend = backend
        self.drive = Drive(config)
        self.commands = Stream()
        self.requests: Inbox[PendingQuery] = Inbox(wake=self.commands.wake if clock == "paced" else None)
        self.controller = ControllerPresence(wake=self.commands.wake)
        self.deferred: DeferredReply | None = None
        self.handlers: dict[str, Callable[[PendingQuery, Any], None]] = {
            topics.STATE_QUERY.key: self._tell_state,
            topics.DESCRIPTION.key: self._describe,
            topics.RECOVER.key: self._recover,
            topics.HOLD.key: self._hold,
            topics.GUIDE.key: self._guide,
        }
        self._bus = bus
        self._stray_puts = StrayPuts(bus, log)
        self._refusals = ThrottledLog(log)
        self._applied: deque[int] = deque(maxlen=backend.abilities.delay_ticks + 1)
        self._state = self.publisher(topics.STATE)
        self.begin_run(run)

    def publisher(self, topic: topics.Publication[topics.MessageT]) -> Publisher[topics.MessageT]:
        """Return a publisher that waits for slow links, except in real time."""
        return self._bus.publisher(topic, blocking=self.clock != "realtime")

    def open(self) -> None:
        """Declare everything on the bus and publish the first tick."""
        self._bus.stream(topics.COMMAND, self.commands)
        if self.clock == "paced":
            self._bus.watch_alive(topics.alive_key("controller"), self.controller.see)
        for query in topics.QUERIES:
            if query.key in self.handlers:
                self._bus.serve(query, self.requests)
        self.publish()
        self._bus.announce(topics.ROBOT_SIDE)

    def begin_run(self, run: int | None = None) -> None:
        """Number the run that the backend has started, and hold the pose until commands arrive."""
        now = self.backend.observe()
        self.drive.begin(time.time_ns() if run is None else run, now.positions)
        self._applied.clear()

    # --- the verbs ------------------------------------------------------------------------------------

    def receive(self, data: bytes) -> None:
        """Store a command, unless it is malformed, old, or dropped by a disturbance."""
        try:
            command = decode(data, m.Command)
            self.drive.take(command, self.backend.observe().tick)
        except Refusal as refusal:
            self._refusals.warn(f"a command was refused: {refusal}", refusal.code)
            return
        self.controller.note_command()
        if self.loses("command", command.tick):
            self.drive.lose()

    def receive_all(self) -> None:
        """Store all waiting commands."""
        while (taken := self.commands.take()) is not None:
            self.receive(taken)

    def step(self) -> None:
        """Step the robot by a tick, with the command, the last one, or the brake."""
        now = self.backend.observe()
        self.drive.note_ready(now.condition == "ready", now.positions, now.velocities)
        setpoint = self.drive.setpoint(now.positions, now.velocities)
        self._applied.append(self.drive.applied_tick)
        self.backend.step(setpoint)

    def publish(self) -> None:
        """Publish the results of the tick."""
        now = self.backend.observe()
        if not self.loses("state", now.tick):
            self._state.put(self.state_message())
        self.controller.note_state()

    def attend(self, wait_s: float = 0.0) -> None:
        """Answer a request, for which this waits up to `wait_s` s, and the deferred request if it is due."""
        query = self.requests.take(wait_s)
        if query is None:
            self._stray_puts.warn()
        else:
            try:
                self.handlers[query.topic.key](query, query.decode())
            except Refusal as refusal:
                query.refuse(refusal)
        if self.deferred is not None and self.deferred.settle():
            self.deferred = None

    # --- what the clocks and the requests ask ---------------------------------------------------------

    def is_answered(self, tick: int) -> bool:
        """Return whether the controller has answered `tick`, or cannot have received it."""
        return self.drive.answered_tick >= tick or self.loses("state", tick)

    def must_wait(self) -> bool:
        """Return whether the present tick must last until the controller has answered it."""
        return self.controller.is_awaited and not self.is_answered(self.backend.observe().tick)

    def loses(self, stream: str, tick: int) -> bool:
        """Return whether a disturbance drops the message of `tick` on `stream`."""
        return False

    def state_message(self) -> m.State:
        """Return the newest state as published."""
        applied = self._applied[0] if len(self._applied) == self._applied.maxlen else NEVER
        return state_message(self.backend.observe(), self.drive, applied)

    def refuse_while_deferring(self) -> None:
        """Check that no other request has a deferred reply.

        Raises:
            Refusal: `busy`.
        """
        if self.deferred is not None:
            raise Refusal("busy", "a step, reset or recovery is under way; wait for its answer", goal_id=None)

    # --- requests -------------------------------------------------------------------------------------

    def _tell_state(self, query: PendingQuery, _: m.Empty) -> None:
        query.reply(self.state_message())

    def _describe(self, query: PendingQuery, _: m.Empty) -> None:
        query.reply(description(self.config, self.backend.abilities, self.clock, self.drive.run))

    def _recover(self, query: PendingQuery, _: m.Empty) -> None:
        self.refuse_while_deferring()
        self._refuse_while_moving("recover")
        self.backend.recover()
        deadline = time.monotonic() + RECOVERY_S
        self.deferred = DeferredReply(query, self._is_ready, self._recovered, deadline)

    def _hold(self, query: PendingQuery, request: m.Hold) -> None:
        duration = self.backend.hold(request.joints)
        arrival_time = None if duration is None else self.backend.observe().time + duration
        query.reply(m.Held(joints=request.joints, arrival_time=arrival_time))

    def _guide(self, query: PendingQuery, _: m.Empty) -> None:
        self.refuse_while_deferring()
        modes = self.backend.abilities.modes
        if "teach" not in modes:
            sentence = f"this arm cannot be guided by hand: its modes are {', '.join(modes)}; cut a trace instead"
            raise Refusal("unavailable", sentence, service="robot")
        self._refuse_while_moving("guide it")
        self.backend.guide()
        self._state.put(self.state_message())  # the controller must refuse goals before the client gets the reply
        query.reply(m.Guided(condition=self.backend.observe().condition))

    def _refuse_while_moving(self, verb: str) -> None:
        """Refuse while the arm moves, or only turns back: without its setpoint the acceleration would jump.

        Raises:
            Refusal: `busy`.
        """
        now = self.backend.observe()
        fastest, turns = float(np.abs(now.velocities).max()), now.condition == "ready" and self.drive.accelerates
        if fastest > AT_REST or turns:
            how = f"{fastest:.3f} rad/s" + (" and accelerates" if turns else "")
            raise Refusal("busy", f"the arm moves ({how}); {verb} once it rests", goal_id=None)

    def _is_ready(self) -> bool:
        return self.backend.observe().condition == "ready"

    def _recovered(self) -> m.Recovered:
        """Start a new run if the robot is ready, and return the reply."""
        if self._is_ready():
            self.backend.begin_run()
            self.begin_run()
            self.publish()
        return m.Recovered(condition=self.backend.observe().condition, run=self.drive.run)
