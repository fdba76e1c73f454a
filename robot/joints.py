"""Table `joints` of a robot's TOML, checked against the model: its ranges, its torque limits, its keyframes."""

import mujoco
import numpy as np

from robot.schema import JointsTable, RobotError

KEYFRAME = "keyframe:"
DRIVES = int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)
ROUNDING = 1e-3
"""A position less than this (rad, m) outside its range was rounded, and is moved to the end of the range."""


def _vector(joints: JointsTable, key: str) -> np.ndarray:
    """Return a vector or a list of pairs of the table, (J,) or (J, 2)."""
    values = np.array(getattr(joints, key), dtype=float)
    if len(values) != len(joints.names):
        raise RobotError(f"joints.{key}: has {len(values)} values for {len(joints.names)} joints")
    return values


def bounds(joints: JointsTable, key: str) -> np.ndarray:
    """Return a vector of symmetric limits, (J,); inf is allowed."""
    values = _vector(joints, key)
    for name, value in zip(joints.names, values, strict=True):
        if not value > 0:
            raise RobotError(f"joints.{key}: {name}: {value} is not greater than 0")
    return values


def model_ranges(model: mujoco.MjModel, joints: list[int]) -> np.ndarray:
    """Return the ranges of joints in the model, (J, 2), ±inf for none."""
    limited = model.jnt_limited[joints].astype(bool)[:, None]
    return np.where(limited, model.jnt_range[joints], [-np.inf, np.inf])


def ranges(joints: JointsTable, model: mujoco.MjModel, ids: list[int]) -> np.ndarray:
    """Return the ranges of the joints, (J, 2): the model's, or tighter ones; ±inf takes the model's."""
    widest = model_ranges(model, ids)
    if joints.positions is None:
        return widest
    asked = _vector(joints, "positions")
    asked = np.where(np.isinf(asked), widest, asked)
    for name, (low, high), (lowest, highest) in zip(joints.names, asked, widest, strict=True):
        if not low < high:
            raise RobotError(f"joints.positions: {name}: {low:.6g} to {high:.6g} is not a range")
        if low < lowest - ROUNDING or high > highest + ROUNDING:
            raise RobotError(
                f"joints.positions: {name}: {low:.6g} to {high:.6g} is wider than the model's range, "
                f"{lowest:.6g} to {highest:.6g}; ranges here can only be tighter"
            )
    return np.clip(asked, widest[:, :1], widest[:, 1:])


def torques(joints: JointsTable, model: mujoco.MjModel, ids: list[int]) -> np.ndarray:
    """Return the torque limits of the joints, (J,), N·m: the model's, or tighter ones; inf takes the model's."""
    limits = np.array([torque_limit(model, joint) for joint in ids])
    if joints.torques is None:
        return limits
    asked = bounds(joints, "torques")
    asked = np.where(np.isinf(asked), limits, asked)
    for name, value, limit in zip(joints.names, asked, limits, strict=True):
        if value > limit:
            raise RobotError(
                f"joints.torques: {name}: {value:.6g} N·m is more than the model's {limit:.6g} N·m; "
                "limits here can only be tighter"
            )
    return asked


def home(joints: JointsTable, model: mujoco.MjModel, ids: list[int], positions: np.ndarray) -> np.ndarray:
    """Return the home pose, (J,), checked against the ranges (J, 2)."""
    if isinstance(joints.home, str):
        pose = _keyframe(joints.home, model)[model.jnt_qposadr[ids]]
    else:
        pose = _vector(joints, "home")
    checked = zip(joints.names, pose, positions, strict=True)
    return np.array([inside(f"joints.home: {name}", value, bounds) for name, value, bounds in checked])


def _keyframe(home: str, model: mujoco.MjModel) -> np.ndarray:
    """Return the positions of a keyframe of the whole model, (nq,)."""
    name = home.removeprefix(KEYFRAME)
    keys = [model.key(i).name for i in range(model.nkey)]
    if name == home or name not in keys:
        known = ", ".join(f'"{KEYFRAME}{key}"' for key in filter(None, keys)) or "none"
        raise RobotError(f"joints.home: {home!r} is not a keyframe of the model; it has {known}")
    return model.key(name).qpos


def inside(where: str, value: float, bounds: np.ndarray) -> float:
    """Return a position; one that rounding put outside its range (2,) is moved to the range's end."""
    low, high = bounds
    if not (low - ROUNDING <= value <= high + ROUNDING and np.isfinite(value)):
        raise RobotError(f"{where}: {value} lies outside its range {low:.6g} to {high:.6g}")
    return float(np.clip(value, low, high))


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
