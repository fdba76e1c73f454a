"""Messages about a ball in play."""

import time
from collections.abc import Iterable
from typing import Any, NamedTuple

from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from protocol.errors import NoAnswer
from protocol.messages import Contact
from robot.court import BALL

LENGTH = 1024
"""Capacity of the queue of each topic, messages."""
POLL_S = 0.01
"""Period of polling. A thread that woke for each message would take time from striker and planner at each sight."""
STALLED_S = 10.0
"""Timeout of the sim's ball messages, s of wall time."""


class Received(NamedTuple):
    """A message, the robot that it is about, and the Unix time at which the router had it, ns."""

    robot: str
    message: Any
    routed_ns: int


class Messages:
    """The messages of some topics, each of one robot."""

    def __init__(self, sources: Iterable[tuple[Bus, topics.Publication[Any]]]) -> None:
        self._sources = [(bus, topic, bus.collect(topic, LENGTH)) for bus, topic in sources]

    def take(self) -> list[Received]:
        """Wait for messages, and return them.

        Raises:
            NoAnswer: none arrives.
        """
        deadline = time.monotonic() + STALLED_S
        while time.monotonic() < deadline:
            if found := self.waiting():
                return found
            time.sleep(POLL_S)
        key = self._sources[0][0].key(topics.BALL.key)
        raise NoAnswer("sim", key, f"no ball was published for {STALLED_S:g} s")

    def waiting(self) -> list[Received]:
        """Return the messages that have arrived, in the order of the router."""
        found = [
            Received(bus.robot, decode(body, topic.message), routed_ns)
            for bus, topic, source in self._sources
            for body, routed_ns in iter(source.take, None)
        ]
        return sorted(found, key=lambda received: received.routed_ns)


def forbidden_contact(contact: Contact) -> str:
    """Return a sentence for the start of a contact without the ball; empty for other contacts."""
    if BALL in contact.bodies or contact.ended:
        return ""
    return f"{' and '.join(contact.bodies)} touched at {contact.time:.3f} s"
