"""State of the moving parts of the model that the planner does not control: held joints and other robots."""

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from robot.description import RobotConfig
from robot.motion_check import MotionCheck
from services.common.other_robots import received
from services.planner.other_robot import OtherRobot


class Scene:
    """Updates the motion check with the newest held joints, and with other robots' poses and motions."""

    def __init__(self, bus: Bus, config: RobotConfig, motions: MotionCheck) -> None:
        self._motions = motions
        self._held = {joint for joint in config.held if not any(joint in other for other in config.others.values())}
        self._own = bus.collect(topics.STATE, 1) if config.held else None
        self._time: float | None = None
        self._others = [OtherRobot(Bus(bus.session, name), joints) for name, joints in config.others.items()]
        for other in self._others:
            other.positions = [config.held[joint] for joint in other.joints]

    def update(self) -> bool:
        """Process the newest states and plans; return whether another robot has started a motion since the last call.

        Joints without a new state keep their positions.
        """
        for own in received(self._own, m.State) if self._own else ():
            self._time = own.time
            known = {joint: value for joint, value in own.held.items() if joint in self._held}
            self._motions.clearance.surround(tuple(known), list(known.values()))
        began = False
        for other in self._others:
            began |= other.update()
            self._motions.clearance.surround(other.joints, other.positions)
        self._motions.others = ()
        if self._time is not None:
            found = tuple(other.motion(self._time) for other in self._others)
            if any(motion.plans for motion in found):
                self._motions.others = found
        return began
