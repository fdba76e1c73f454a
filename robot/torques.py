"""Torques that a motion needs."""

import mujoco
import numpy as np

from robot.description import RobotConfig
from robot.model import joint_ids


class InverseDynamics:
    """Torques by inverse dynamics; gravity, damping and friction included. It holds its own data: use one a thread.

    What else the model has moves with the arm or is at rest. Contacts, stops and equalities carry nothing: they are
    switched off in `model`.
    """

    def __init__(self, config: RobotConfig, model: mujoco.MjModel) -> None:
        self._model = model
        self._data = mujoco.MjData(model)
        joints = joint_ids(model, config.joint_names)
        self._qpos, self._dofs = (a[joints].astype(np.intp) for a in (model.jnt_qposadr, model.jnt_dofadr))
        self._data.qpos[:] = config.pose_at_home
        rubs = bool(model.dof_frictionloss.any() or model.tendon_frictionloss.any())
        for flag in ("CONTACT", "LIMIT", "EQUALITY") if rubs else ("CONSTRAINT",):
            model.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}"))

    def torques(self, positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
        """Return the torques (J,), N·m, of a state of the arm, (J,) each."""
        data = self._data
        data.qpos[self._qpos] = positions
        data.qvel[self._dofs] = velocities
        data.qacc[self._dofs] = accelerations
        mujoco.mj_inverseSkip(self._model, data, int(mujoco.mjtStage.mjSTAGE_NONE), 1)
        return data.qfrc_inverse[self._dofs]
