"""Kinematics of the tool."""

import mujoco
import numpy as np

from robot.description import RobotConfig
from robot.model import joint_ids


class Kinematics:
    """Pose and velocity of the tool site in the world frame. Not thread-safe: use one a thread.

    model: MuJoCo model. joint_ids: indices of the arm's joints in it. site: index of the tool's site.
    """

    def __init__(self, config: RobotConfig) -> None:
        self.model = config.model
        self.joint_ids = joint_ids(self.model, config.joint_names)
        self.site = self.model.site(config.tool.site).id
        self._data = mujoco.MjData(self.model)
        self._data.qpos[:] = config.pose_at_home
        self._qpos = self.model.jnt_qposadr[self.joint_ids]
        self._dofs = self.model.jnt_dofadr[self.joint_ids]
        self._jacobian = np.zeros((3, self.model.nv))

    def tool_pose(self, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,), m, and rotation matrix (3, 3) of the tool at joint positions (J,)."""
        self._place(positions)
        rotation = self._data.site_xmat[self.site].reshape(3, 3)
        return self._data.site_xpos[self.site].copy(), rotation.copy()

    def tool_velocity(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        """Linear velocity (3,), m/s, of the tool at joint positions and velocities (J,)."""
        self._place(positions)
        mujoco.mj_jacSite(self.model, self._data, self._jacobian, None, self.site)
        return self._jacobian[:, self._dofs] @ velocities

    def _place(self, positions: np.ndarray) -> None:
        self._data.qpos[self._qpos] = positions
        mujoco.mj_kinematics(self.model, self._data)
        mujoco.mj_comPos(self.model, self._data)
