"""Convert accelerations to the environment's actions."""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from benchmarks.table_tennis.scene import GEARS
from robot.model import joint_ids


class Motors:
    """Inverse dynamics of an environment's arm. It owns its MuJoCo data."""

    def __init__(self, env: Any, joints: Sequence[str]) -> None:
        self._env, self._model = env, env.model
        self._data = mujoco.MjData(self._model)
        self._dofs = self._model.jnt_dofadr[joint_ids(self._model, tuple(joints))]
        self._damping = self._model.dof_damping[self._dofs]
        self._full = np.zeros((self._model.nv, self._model.nv))

    def action(self, velocities: np.ndarray, accelerations: np.ndarray, planned: np.ndarray) -> np.ndarray:
        """Return the torques (7,), relative to the motors' maximum, for the present state of the arm, clipped to ±1.

        velocities: of the arm. planned: velocities of the reference in the middle of the tick, rad/s, for which damping
        is compensated. Compensation of the measured velocities would be unstable: that of some joints decays in less
        than a tick.
        """
        model, data = self._model, self._data
        data.qpos[:] = self._env.data.qpos
        data.qvel[:] = 0
        data.qvel[self._dofs] = velocities
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fullM(model, data, self._full)
        mass = self._full[np.ix_(self._dofs, self._dofs)]
        torque = mass @ accelerations + data.qfrc_bias[self._dofs] + self._damping * planned
        return np.clip(torque / GEARS, -1.0, 1.0)
