"""Other robots on the bus that stand in this robot's model."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import islice
from typing import TypeVar

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.queues import Collector
from protocol.codec import decode
from protocol.errors import Refusal
from protocol.topics import SMALL
from robot.conversions import samples_of

MessageT = TypeVar("MessageT", m.State, m.Status, m.Plan)


def received(collector: Collector, kind: type[MessageT], most: int = 1, max_bytes: int = SMALL) -> Iterator[MessageT]:
    """Yield up to `most` messages that came, but for malformed ones, which their robot's own services count and log."""
    for body, _ in islice(iter(collector.take, None), most):
        with suppress(Refusal):
            message = decode(body, kind, max_bytes)
            if isinstance(message, m.Plan):
                samples_of(message)
            yield message


class OtherRobots:
    """The newest states of other robots, by their joints' names in this robot's model."""

    def __init__(self, bus: Bus, others: Mapping[str, tuple[str, ...]]) -> None:
        """Subscribe to the robots in `others`, which maps names on the bus to joints, in the order of their vectors."""
        self._sources = [(joints, Bus(bus.session, name).collect(topics.STATE, 1)) for name, joints in others.items()]

    def take(self) -> Iterator[tuple[tuple[str, ...], m.State]]:
        """Yield the joints and the newest state of each robot that has published since the last call."""
        for joints, source in self._sources:
            for state in received(source, m.State):
                if len(state.positions) == len(state.velocities) == len(joints):
                    yield joints, state
