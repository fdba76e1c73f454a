"""The handshake with the arm: its description, its state, and its presence."""

import logging
import time
from collections.abc import Callable

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.queues import Inbox
from protocol.codec import decode
from protocol.errors import Refusal
from robot.description import RobotConfig
from services.common.logs import ThrottledLog

GREETING_PERIOD_NS = 500_000_000
"""Period of repeated requests: a busy arm or bus may lose a request or its reply."""
NEVER_NS = 1 << 62


class Departed:
    """The arm's liveliness token disappeared."""


class WrongRobot(Exception):
    """The arm on the bus is not that of the robot config."""


class ArmHandshake:
    """Requests the description and then the state of an arm that appears, until both replies have arrived.

    The state is requested because publications before the subscription are lost, and a stepped arm publishes none
    without a step.

    Attributes:
        present: Whether the arm holds its liveliness token.
    """

    def __init__(
        self, bus: Bus, config: RobotConfig, log: logging.Logger, clock: Callable[[], int] = time.perf_counter_ns
    ) -> None:
        """Prepare; `clock` returns monotonic time, ns."""
        self.present = False
        self._bus = bus
        self._config = config
        self._clock = clock
        self._refusals = ThrottledLog(log)
        self._sightings: Inbox[bool] = Inbox()
        self._replies: Inbox[tuple[type[m.Description | m.State], bytes]] = Inbox()
        self._next_greeting_ns = NEVER_NS

    def open(self) -> None:
        """Subscribe to the arm's liveliness token."""
        self._bus.watch_alive(topics.alive_key(topics.ROBOT_SIDE), self._receive)

    def step(self) -> m.Description | m.State | Departed | None:
        """Send the request that is due; return the arm's next reply, or that it has left, or None.

        Raises:
            WrongRobot: the arm is not that of the robot config.
        """
        if (appeared := self._sightings.take()) is not None:
            if not appeared:
                return Departed()
            self._next_greeting_ns = 0
        if self._next_greeting_ns != NEVER_NS and (now_ns := self._clock()) >= self._next_greeting_ns:
            self._next_greeting_ns = now_ns + GREETING_PERIOD_NS
            self._ask(topics.DESCRIPTION)
        reply = self._replies.take()
        return self._read(*reply) if reply is not None else None

    def _ask(self, topic: topics.Query) -> None:
        self._bus.ask_later(topic, m.Empty(), lambda body: self._replies.offer((topic.reply, body)))

    def _read(self, kind: type[m.Description | m.State], body: bytes) -> m.Description | m.State | None:
        """Decode a reply and continue with the next request; on an open bus anyone may reply with anything."""
        try:
            arm = decode(body, kind)
        except Refusal as refusal:
            self._refusals.warn(f"a reply of the arm was refused: {refusal}", refusal.code)
            return None
        if isinstance(arm, m.State):
            self._next_greeting_ns = NEVER_NS
            return arm
        ours = list(self._config.joint_names), self._config.rate_hz
        if (arm.joint_names, arm.rate_hz) != ours:
            raise WrongRobot(f"the arm has joints {arm.joint_names} at {arm.rate_hz} Hz, the robot config {ours}")
        self._ask(topics.STATE_QUERY)
        return arm

    def _receive(self, _: str, alive: bool) -> None:
        self.present = alive
        self._sightings.offer(alive)
