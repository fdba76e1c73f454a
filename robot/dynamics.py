"""Gravity and inertia of an arm, over its joint ranges."""

from dataclasses import dataclass

import mujoco
import numpy as np

POSES = 200


@dataclass(frozen=True, slots=True, eq=False)
class Load:
    """Gravity and inertia in n poses of J joints.

    Attributes:
        gravity: (n, J), N·m, the torque that balances gravity.
        inertia: (n, J, J), kg·m².
    """

    gravity: np.ndarray
    inertia: np.ndarray


def sample_poses(ranges: np.ndarray, count: int = POSES) -> np.ndarray:
    """Return random poses (count, J), uniform over ranges (J, 2); ±π for a joint without a range."""
    bounded = np.where(np.isfinite(ranges), ranges, [-np.pi, np.pi])
    return np.random.default_rng(0).uniform(*bounded.T, size=(count, len(ranges)))


def load_at(model: mujoco.MjModel, qpos: np.ndarray, joints: list[int], poses: np.ndarray) -> Load:
    """Return gravity and inertia at poses (n, J) of the joints; the rest of the model is at `qpos` (nq,)."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    addresses, dofs = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
    gravity, inertia = [], []
    bias, full = np.zeros(model.nv), np.zeros((model.nv, model.nv))
    for pose in poses:
        data.qpos[addresses] = pose
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_crb(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, bias)
        mujoco.mj_fullM(model, data, full)
        gravity.append(bias[dofs])
        inertia.append(full[np.ix_(dofs, dofs)])
    return Load(np.array(gravity), np.array(inertia))
