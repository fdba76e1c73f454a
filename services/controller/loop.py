"""The controller on its bus: receive a state, answer it with a command, answer one request."""

import contextlib
import logging
import threading
import time
from collections import deque
from collections.abc import Callable

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.queues import Stream
from protocol.codec import decode
from protocol.errors import Refusal
from robot.description import RobotConfig
from services.common.logs import ThrottledLog
from services.common.stray_puts import StrayPuts
from services.common.ticks import tick_of
from services.controller.checker import TrajectoryChecker
from services.controller.core import Controller
from services.controller.handshake import ArmHandshake, Departed
from services.controller.incidents import touch_of
from services.controller.leases import ClientLeases
from services.controller.publications import Publications
from services.controller.requests import Requests
from services.controller.watchdog import SilenceWatchdog

WAITING_CONTACTS = 64
"""Capacity of the queue of contacts. The loop handles one a tick; a full queue drops the oldest."""
FAREWELL_S = 3.0
"""Timeout of the arm's stop when the controller ends."""


class ControllerLoop:
    """Owns the controller; all input arrives in queues."""

    def __init__(
        self, bus: Bus, config: RobotConfig, log: logging.Logger, clock: Callable[[], int] = time.perf_counter_ns
    ) -> None:
        """Prepare; `clock` returns monotonic time, ns."""
        self._bus = bus
        self._config = config
        self._log = log
        self._clock = clock
        self._core = Controller(config)
        self._states = Stream()
        self._watchdog = SilenceWatchdog(config.tick, clock)
        self._handshake = ArmHandshake(bus, config, log, clock)
        self._leases = ClientLeases(self._core, log)
        self._checker = TrajectoryChecker(config, StrayPuts(bus, log), log, wake=self._states.wake)
        self._requests = Requests(self._core, self._leases, self._checker, self._catch_up, wake=self._states.wake)
        self._publications = Publications(bus, self._core, log, clock)
        self._contacts: deque[bytes] = deque(maxlen=WAITING_CONTACTS)
        self._refusals = ThrottledLog(log)
        self._arm_clock: m.Clock | None = None
        self._request_answered = False

    def open(self) -> None:
        """Declare everything on the bus; the handshake begins when the arm appears."""
        self._bus.stream(topics.STATE, self._states)
        self._bus.listen(topics.CONTACT, self._contacts.append)
        self._requests.open(self._bus)
        self._handshake.open()
        self._leases.open(self._bus)
        self._checker.start()
        self._bus.announce("controller")

    def run(self, stopping: threading.Event) -> None:
        """Answer states until `stopping` is set.

        Raises:
            WrongRobot: the arm on the bus is another one.
        """
        while not stopping.is_set():
            self.turn()

    def turn(self) -> None:
        """Receive states for up to about a tick, answer the newest, handle events and one request.

        Raises:
            WrongRobot: the arm on the bus is another one.
        """
        self._answer(self._receive())
        self._attend()

    def close(self) -> None:
        """Stop the arm under control while states still arrive, and end the checker."""
        with contextlib.suppress(Refusal):
            self._core.cancel(m.Cancel())
        deadline_ns = self._clock() + round(FAREWELL_S * 1e9)
        while not self._core.resting and not self._arm_is_silent and self._clock() < deadline_ns:
            self._answer(self._receive())
            self._publications.report()
        self._checker.close()

    # --- the three verbs ------------------------------------------------------------------------------

    def _receive(self) -> list[bytes]:
        """Wait for about a tick for a state, and return the queued states (one, unless in real time).

        The arrival of a request ends the wait.
        """
        taken = self._states.take(self._watchdog.time_left)
        waiting = [taken] if taken is not None else []
        return waiting + self._states.take_all() if waiting and self._arm_clock == "realtime" else waiting

    def _answer(self, received: list[bytes]) -> None:
        """Answer the newest valid state and count invalid ones after it; without a valid one, count the silence."""
        received_ns = self._clock()
        for body in reversed(received):
            state = self._decode(body)
            if state is not None and self._respond(state, received_ns):
                return
            self._core.statistics.refused += 1
        if not self._watchdog.end_wait():
            return
        self._request_answered = False
        silent = self._watchdog.silent_waits
        if silent == self._config.silence_ticks and self._arm_clock == "realtime" and self._core.states.newest:
            self._log.error("the arm fell silent; any motion is aborted")
            self._core.raise_fault(f"no state for {silent} ticks")

    def _catch_up(self) -> None:
        """Process the states that are there, for a motion whose sender may know that the arm no longer follows."""
        for body in self._states.take_all():
            self._answer([body])

    def _attend(self) -> None:
        """Apply at most one event of each kind, answer at most one request a tick, and publish."""
        self._attend_to_arm()
        self._leases.step()
        self._note_contact()
        if not self._request_answered:
            self._request_answered = self._requests.answer_one()
        self._publications.report()

    # --- the arm --------------------------------------------------------------------------------------

    @property
    def _arm_is_silent(self) -> bool:
        """Whether no state is overdue. With the clock paced, the arm waits for this process and may be slow."""
        if self._arm_clock == "paced":
            return not self._handshake.present
        return self._watchdog.silent_waits >= self._config.silence_ticks

    def _decode(self, body: bytes) -> m.State | None:
        try:
            return decode(body, m.State)
        except Refusal as refusal:
            self._refusals.warn(f"a state was refused: {refusal}", refusal.code)
            return None

    def _respond(self, state: m.State, received_ns: int) -> bool:
        """Publish the command that answers `state`; return False for a state that is old, duplicate or does not fit."""
        command = self._core.answer(state, time.time_ns())
        if command is None:
            return False
        self._publications.commands.put(command)
        self._watchdog.feed(received_ns)
        self._request_answered = False
        self._core.statistics.note_response(self._clock() - received_ns)
        return True

    def _note_contact(self) -> None:
        """Process a contact that the robot side has published."""
        if self._contacts:
            with contextlib.suppress(Refusal):  # a message that cannot be decoded counts as lost
                contact = decode(self._contacts.popleft(), m.Contact)
                if touch := touch_of(contact, self._config):
                    self._core.ledger.note_touch(touch, tick_of(contact.time, self._config.rate_hz))

    def _attend_to_arm(self) -> None:
        """Take over the clock of an arm that appears, answer its requested state, and fault when it leaves."""
        arm = self._handshake.step()
        if arm is None:
            return
        if isinstance(arm, Departed):
            if self._arm_clock == "paced" and self._core.states.newest:
                self._core.raise_fault("the arm is gone: its token alive/sim disappeared from the bus")
        elif isinstance(arm, m.Description):
            self._arm_clock = arm.clock
            self._core.meet(arm)
            self._publications.declare(blocking=arm.clock != "realtime")
            self._log.info("the arm is there: %d joints, %s clock, run %d", len(arm.joint_names), arm.clock, arm.run)
        elif not self._core.states.has_seen(arm.run, arm.tick):
            self._respond(arm, self._clock())
