"""Where everything is that moves in the robot's model without the planner: held joints and other robots."""

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from protocol.errors import Refusal
from robot.clearance import Clearance
from robot.description import RobotConfig
from services.common.other_robots import OtherRobots


class Scene:
    """Puts held joints and other robots where their newest states have them, for the check in space."""

    def __init__(self, bus: Bus, config: RobotConfig, clearance: Clearance) -> None:
        self._clearance = clearance
        self._held = frozenset(config.held)
        self._own = bus.collect(topics.STATE, 1) if config.held else None
        self._others = OtherRobots(bus, config.others)

    def look(self) -> None:
        """Take the newest states; what none has come from since the last call stays where it was."""
        taken = None if self._own is None else self._own.take()
        if taken is not None:
            self._place_held(taken[0])
        # After the held joints, which in this robot's own simulation may be the others' too.
        for joints, state in self._others.take():
            self._clearance.surround(joints, state.positions)

    def _place_held(self, state: bytes) -> None:
        try:
            held = decode(state, m.State).held
        except Refusal:
            return  # the controller counts and logs it
        known = {joint: value for joint, value in held.items() if joint in self._held}
        self._clearance.surround(tuple(known), list(known.values()))
