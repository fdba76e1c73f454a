"""Torques of a motion, by inverse dynamics."""

import mujoco
import numpy as np

from robot.description import RobotConfig
from robot.model import addresses, joint_ids


class InverseDynamics:
    """Torques by inverse dynamics, with gravity, damping and friction. Not thread-safe: use one a thread.

    All other bodies of the model move with the arm or are at rest. Contacts, joint stops and equalities exert no force:
    they are disabled in `model`.

    friction: (J,), N·m, largest friction torque of each joint.
    """

    def __init__(self, config: RobotConfig, model: mujoco.MjModel) -> None:
        self._model = model
        self._data = data = mujoco.MjData(model)
        joints = joint_ids(model, config.joint_names)
        self._qpos, self._dofs = (addresses(all_of[joints]) for all_of in (model.jnt_qposadr, model.jnt_dofadr))
        data.qpos[:] = config.pose_at_home
        self._state = data.qpos, data.qvel, data.qacc
        self._found, self._inertia = data.qfrc_inverse, np.empty((model.nv, model.nv))
        self.friction = model.dof_frictionloss[self._dofs].copy()
        rubs = bool(model.dof_frictionloss.any() or model.tendon_frictionloss.any())
        for flag in ("CONTACT", "LIMIT", "EQUALITY") if rubs else ("CONSTRAINT",):
            model.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}"))

    def torques(self, positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
        """Return the torques (J,), N·m, of a state of the arm, (J,) each."""
        qpos, qvel, qacc = self._state
        qpos[self._qpos] = positions
        qvel[self._dofs] = velocities
        qacc[self._dofs] = accelerations
        mujoco.mj_inverseSkip(self._model, self._data, _FROM_SCRATCH, 1)
        return self._found[self._dofs].copy()

    def inertia(self) -> np.ndarray:
        """Return the inertia matrix (J, J), kg·m², at the positions of the last call to `torques`."""
        mujoco.mj_fullM(self._model, self._data, self._inertia)
        return self._inertia[self._dofs][:, self._dofs].copy()


_FROM_SCRATCH = int(mujoco.mjtStage.mjSTAGE_NONE)
