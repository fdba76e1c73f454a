"""Movable joints of a robot's model other than the arm and the ball: grippers, loose objects, other arms."""

from collections.abc import Mapping

import mujoco

from robot.court import BALL
from robot.description import RobotConfig

_COORDINATES = {
    int(mujoco.mjtJoint.mjJNT_FREE): 7,
    int(mujoco.mjtJoint.mjJNT_BALL): 4,
    int(mujoco.mjtJoint.mjJNT_SLIDE): 1,
    int(mujoco.mjtJoint.mjJNT_HINGE): 1,
}


class Surroundings:
    """The joints of a model that are neither the arm's nor the ball's."""

    def __init__(self, config: RobotConfig, model: mujoco.MjModel) -> None:
        self._spans: dict[str, slice] = {}
        for joint in range(model.njnt):
            name = model.joint(joint).name or f"joint_{joint}"
            if name not in config.joint_names and model.body(model.jnt_bodyid[joint]).name != BALL:
                start = int(model.jnt_qposadr[joint])
                self._spans[name] = slice(start, start + _COORDINATES[int(model.jnt_type[joint])])

    def __bool__(self) -> bool:
        """Whether the model has such a joint."""
        return bool(self._spans)

    def read(self, data: mujoco.MjData) -> dict[str, list[float]]:
        """Return the coordinates of each joint: an angle or a distance, a quaternion, or position and quaternion."""
        return {name: data.qpos[span].tolist() for name, span in self._spans.items()}

    def place(self, data: mujoco.MjData, joints: Mapping[str, list[float]]) -> None:
        """Set the coordinates of joints; ignore joints that are missing or have another number of them."""
        for name, coordinates in joints.items():
            span = self._spans.get(name)
            if span is not None and len(coordinates) == span.stop - span.start:
                data.qpos[span] = coordinates
