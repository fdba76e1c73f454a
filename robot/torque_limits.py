"""Torque limits of joints, from a MuJoCo model."""

import mujoco
import numpy as np

DRIVES = int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)


def torque_limit(model: mujoco.MjModel, joint: int) -> float:
    """Return the largest torque (N·m) in either direction, from the limits of the joint and of its actuators."""
    limit = np.inf
    if model.jnt_actfrclimited[joint]:
        limit = np.abs(model.jnt_actfrcrange[joint]).min()
    for actuator in range(model.nu):
        if model.actuator_trntype[actuator] not in DRIVES or model.actuator_trnid[actuator, 0] != joint:
            continue
        gear = abs(model.actuator_gear[actuator, 0])
        if model.actuator_forcelimited[actuator]:
            limit = min(limit, gear * np.abs(model.actuator_forcerange[actuator]).min())
        if _is_motor(model, actuator) and model.actuator_ctrllimited[actuator]:
            limit = min(limit, gear * np.abs(model.actuator_ctrlrange[actuator]).min())
    return float(limit)


def _is_motor(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether the actuator's control equals its force, so that both have the same range."""
    return (
        model.actuator_gaintype[actuator] == int(mujoco.mjtGain.mjGAIN_FIXED)
        and model.actuator_biastype[actuator] == int(mujoco.mjtBias.mjBIAS_NONE)
        and model.actuator_gainprm[actuator, 0] == 1.0
    )
