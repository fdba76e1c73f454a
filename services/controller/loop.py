"""The controller on its bus: receive a state, answer it, attend to one request."""

import contextlib
import logging
import threading
import time
from collections.abc import Callable
from typing import Any

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus, PendingQuery
from protocol.bus.queues import Inbox, Stream
from protocol.codec import decode
from protocol.errors import Refusal
from protocol.topics import QUEUE_LENGTH
from robot.description import RobotConfig
from services.common.logs import ThrottledLog
from services.common.puts import PutWatch
from services.controller.checks import Checked, check_trajectory
from services.controller.core import Controller

FIRST_WAIT = 1.2
"""In ticks; more than one, so that the next state ends the wait and not the clock."""
WAIT = 0.96
"""In ticks, all later ones: less than one, so that 20 end within 20 ticks of the last state, even if it was late."""
STALL_NS = 5_000_000
"""Of a time in which the loop did not run, so much counts: a sim that is killed holds its core up for 2 to 4 ms."""
STATUS_PERIOD_NS = 20_000_000
GREETING_PERIOD_NS = 500_000_000
NEVER_NS = 1 << 62
FAREWELL_S = 3.0
MAX_SIGHTINGS = 256
"""Notices of clients that wait for the loop, which takes one a tick: more come only of somebody who means harm."""


class WrongRobot(Exception):
    """The arm on the bus is not the one in the robot config."""


class ControllerLoop:
    """Owns the controller; everything from outside comes through its stream and its queues."""

    def __init__(self, bus: Bus, config: RobotConfig, log: logging.Logger) -> None:
        self._bus = bus
        self._config = config
        self._log = log
        self._core = Controller(config)
        self._states = Stream()
        self._urgent: Inbox[PendingQuery] = Inbox(wake=self._states.wake)
        self._requests: Inbox[PendingQuery] = Inbox(wake=self._states.wake)
        self._trajectories: Inbox[PendingQuery] = Inbox()
        self._checked: Inbox[tuple[PendingQuery, Checked]] = Inbox(wake=self._states.wake)
        self._attended = False
        self._sightings: Inbox[tuple[str, bool]] = Inbox(MAX_SIGHTINGS)
        self._sightings_lost = threading.Event()
        self._arm_seen = threading.Event()
        self._next_greeting_ns = NEVER_NS
        self._answers: Inbox[Callable[[], None]] = Inbox()
        self._puts = PutWatch(bus, log)
        self._refusals = ThrottledLog(log)
        self._floods = ThrottledLog(log)
        self._fault_told: str | None = None
        self._first_wait_ns, self._wait_ns = (round(ticks * config.tick * 1e9) for ticks in (FIRST_WAIT, WAIT))
        self._silent_waits = 0
        self._wait_ends_ns = 0
        self._clock: m.Clock | None = None
        self._next_status_ns = 0
        self._closed = threading.Event()
        self._checker = threading.Thread(target=self._check_trajectories, name="checker", daemon=True)
        self._handlers: dict[str, Callable[[Any], Any]] = {
            topics.REFERENCE.key: self._core.reference,
            topics.CANCEL.key: self._core.cancel,
            topics.RESET.key: lambda _: self._core.reset(),
            topics.RESULT.key: lambda request: self._core.ledger.result(request.goal_id),
            topics.STATUS_QUERY.key: lambda _: self._core.status(),
        }
        self._declare_publishers(blocking=False)

    def open(self) -> None:
        """Declare everything on the bus; the arm introduces itself as soon as it is there."""
        self._bus.stream(topics.STATE, self._states)
        for query in topics.QUERIES:
            if query.owner == "controller" and query.key in self._handlers:
                self._bus.serve(query, self._requests if query.reads else self._urgent)
        self._bus.serve(topics.EXECUTE, self._trajectories)
        self._bus.watch_alive(topics.alive_key("sim"), self._see_arm)
        self._bus.watch_alive(topics.client_alive_key("*"), self._see_client)
        self._checker.start()
        self._bus.announce("controller")

    def run(self, stopping: threading.Event) -> None:
        """Answer states until `stopping` is set.

        Raises:
            WrongRobot: the arm on the bus is another one.
        """
        while not stopping.is_set():
            self._answer(self._receive())
            self._attend()

    def close(self) -> None:
        """Stop the arm under control while states still come, and end the checker."""
        with contextlib.suppress(Refusal):
            self._core.cancel(m.Cancel())
        deadline = time.monotonic() + FAREWELL_S
        silence = self._config.silence_ticks
        while not self._core.resting and self._silent_waits < silence and time.monotonic() < deadline:
            self._answer(self._receive())
            self._tell()
        self._closed.set()
        self._checker.join(1.0)

    # --- the three verbs ------------------------------------------------------------------------------

    def _receive(self) -> list[bytes]:
        """Return the states that wait (in stepped time the next one), after waiting for one for about a tick.

        Sooner, and none, where a request comes meanwhile.
        """
        left_ns = self._wait_ends_ns - time.perf_counter_ns()
        taken = self._states.take(max(0, left_ns) * 1e-9)
        waiting = [taken] if taken is not None else []
        while waiting and self._clock == "realtime" and (newer := self._states.take()) is not None:
            waiting.append(newer)
        return waiting

    def _answer(self, received: list[bytes]) -> None:
        """Publish the command that answers the newest good state; count the silence where there is none."""
        began_ns = time.perf_counter_ns()
        for data in reversed(received):
            command = self._command(data)
            if command is not None:
                self._commands.put(command)
                self._silent_waits, self._wait_ends_ns = 0, began_ns + self._first_wait_ns
                self._attended = False
                self._core.cycle.note_response(time.perf_counter_ns() - began_ns)
                return
        if began_ns < self._wait_ends_ns:
            return
        self._wait_ends_ns = max(self._wait_ends_ns + self._wait_ns, began_ns - STALL_NS)
        self._silent_waits += 1
        self._attended = False
        if self._silent_waits == self._config.silence_ticks and self._clock == "realtime" and self._core.awake:
            self._log.error("the arm fell silent; any motion is aborted")
            self._core.raise_fault(f"no state for {self._silent_waits} ticks")

    def _command(self, data: bytes) -> m.Command | None:
        """Return the command that answers a state, or None where it is old, doubled or malformed."""
        try:
            return self._core.answer(decode(data, m.State), time.time_ns())
        except Refusal as refusal:
            self._core.cycle.refused += 1
            self._refusals.warn(f"a state was refused: {refusal}", refusal.code)
            return None

    def _attend(self) -> None:
        """Apply at most one of each kind of event, and one request a tick, a stop before a motion before a question."""
        self._look_at_arm()
        self._look_at_clients()
        if not self._attended:
            self._attended = self._apply_request()
        self._tell()

    def _apply_request(self) -> bool:
        if (asking := self._urgent.take()) is not None:
            self._handle(asking)
        elif (checked := self._checked.take()) is not None:
            self._execute(*checked)
        elif (asking := self._requests.take()) is not None:
            self._handle(asking)
        else:
            return False
        return True

    def _tell(self) -> None:
        for result in self._core.ledger.take_ended():
            self._ended.put(result)
            goal_id = result.goal_id
            self._log.info("goal %s %s %s", goal_id, result.outcome, result.reason, extra={"goal_id": goal_id})
        if self._core.fault != self._fault_told:
            self._fault_told = self._core.fault
            if self._fault_told:
                self._log.error("in fault: %s", self._fault_told, extra={"code": "fault"})
            else:
                self._log.info("out of the fault")
        now_ns = time.monotonic_ns()
        if self._core.awake and (self._core.changed or now_ns >= self._next_status_ns):
            self._core.changed = False
            self._next_status_ns = now_ns + STATUS_PERIOD_NS
            self._status.put(self._core.status())

    # --- requests and events --------------------------------------------------------------------------

    def _handle(self, asking: PendingQuery) -> None:
        self._reply(asking, lambda: self._handlers[asking.topic.key](asking.decode()))

    def _reply(self, asking: PendingQuery, act: Callable[[], Any]) -> None:
        try:
            asking.reply(act())
        except Refusal as refusal:
            asking.refuse(refusal)

    def _check_trajectories(self) -> None:
        """Decode and check the bodies of `execute` beside the loop, which then only has to splice them."""
        while not self._closed.is_set():
            asking = self._trajectories.take(0.2)
            self._puts.look()
            if asking is None:
                continue
            try:
                checked = check_trajectory(asking.decode(), self._config)
            except Refusal as refusal:
                asking.refuse(refusal)
                continue
            if not self._checked.offer((asking, checked)):
                sentence = f"controller has {QUEUE_LENGTH} trajectories waiting; send this one again later"
                asking.refuse(Refusal("busy", sentence, goal_id=checked.message.goal_id))

    def _execute(self, asking: PendingQuery, checked: Checked) -> None:
        self._reply(asking, lambda: self._core.execute(checked, time.time_ns()))

    def _see_arm(self, _: str, alive: bool) -> None:
        if alive:
            self._arm_seen.set()

    def _look_at_arm(self) -> None:
        """Greet an arm that has appeared, again and again until it has answered, and take its next answer."""
        now_ns = time.monotonic_ns()
        if self._arm_seen.is_set():
            self._arm_seen.clear()
            self._next_greeting_ns = now_ns
        if now_ns >= self._next_greeting_ns:
            self._next_greeting_ns = now_ns + GREETING_PERIOD_NS
            self._greet_arm()
        if (answer := self._answers.take()) is not None:
            try:
                answer()
            except Refusal as refusal:
                self._refusals.warn(f"an answer of the arm was refused: {refusal}", refusal.code)

    def _greet_arm(self) -> None:
        """Ask the arm what it is and where: what it published before we listened is lost."""
        self._bus.ask_later(topics.DESCRIPTION, m.Empty(), self._hear_of_arm)

    def _hear_of_arm(self, data: bytes) -> None:
        self._answers.offer(lambda: self._meet_arm(data))

    def _meet_arm(self, data: bytes) -> None:
        arm = decode(data, m.Description)
        ours = list(self._config.joint_names), self._config.rate_hz
        if (arm.joint_names, arm.rate_hz) != ours:
            raise WrongRobot(f"the arm has joints {arm.joint_names} at {arm.rate_hz} Hz, the robot config {ours}")
        self._clock = arm.clock
        self._core.meet(arm)
        self._declare_publishers(blocking=arm.clock != "realtime")
        self._log.info("the arm is there: %d joints, %s clock, run %d", len(arm.joint_names), arm.clock, arm.run)
        self._bus.ask_later(topics.STATE_QUERY, m.Empty(), self._catch_up)

    def _declare_publishers(self, blocking: bool) -> None:
        self._commands = self._bus.publisher(topics.COMMAND, blocking)
        self._status = self._bus.publisher(topics.STATUS, blocking)
        self._ended = self._bus.publisher(topics.ENDED, blocking)

    def _catch_up(self, data: bytes) -> None:
        """Take the state asked for, unless the stream has brought it or a newer one meanwhile."""

        def answer_if_new() -> None:
            state = decode(data, m.State)
            self._next_greeting_ns = NEVER_NS
            if not self._core.has_seen(state.run, state.tick):
                self._answer([data])

        self._answers.offer(answer_if_new)

    def _see_client(self, key: str, alive: bool) -> None:
        if not self._sightings.offer((key.rpartition("/")[2], alive)):
            self._sightings_lost.set()

    def _look_at_clients(self) -> None:
        """Take the next notice of a client; where any was lost, so might be the holder: then all count as gone."""
        if self._sightings_lost.is_set():
            self._sightings_lost.clear()
            while self._sightings.take() is not None:
                pass
            self._floods.warn(f"more than {MAX_SIGHTINGS} notices of clients at once: every lease counts as lost")
            self._core.lose_all_clients()
        sighting = self._sightings.take()
        if sighting is not None:
            client_id, alive = sighting
            (self._core.see_client if alive else self._core.lose_client)(client_id)
