"""Other robots on the bus that stand in this robot's model."""

from collections.abc import Iterator, Mapping

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from protocol.errors import Refusal


class OtherRobots:
    """The newest states of other robots, by their joints' names in this robot's model."""

    def __init__(self, bus: Bus, others: Mapping[str, tuple[str, ...]]) -> None:
        """Subscribe to the robots in `others`, which maps names on the bus to joints, in the order of their vectors."""
        self._sources = [(joints, Bus(bus.session, name).collect(topics.STATE, 1)) for name, joints in others.items()]

    def take(self) -> Iterator[tuple[tuple[str, ...], m.State]]:
        """Yield the joints and the newest state of each robot that has published since the last call."""
        for joints, source in self._sources:
            taken = source.take()
            if taken is None:
                continue
            try:
                state = decode(taken[0], m.State)
            except Refusal:
                continue  # its own controller counts and logs it
            if len(state.positions) == len(state.velocities) == len(joints):
                yield joints, state
