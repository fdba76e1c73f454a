"""Limits of an arm's joints: from its files, derived from them, or assumed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from robot.dynamics import load_at, sample_poses
from robot.joints import model_ranges, torque_limit
from robot.urdf import UrdfJoint

ASSUMED_VELOCITY = 2.0
"""rad/s: most arms of a few kilograms reach it."""
ASSUMED_SLIDE_VELOCITY = 0.5
"""m/s."""
QUANTILE = 0.05
"""Fraction of the poses in which the torques may not suffice for the acceleration limit."""
SPEED_UP_S = 0.1
"""Shortest time to the velocity limit, s: drives do not reach the higher accelerations that a small inertia allows."""
ASSUMED_SPEED_UP_S = 0.25
"""Assumed time to the velocity limit without a torque limit, s."""
JERK_S = 0.03
"""Time from rest to full acceleration, s."""


@dataclass(frozen=True, slots=True)
class Value:
    """A vector of the TOML.

    Attributes:
        numbers: (J,).
        origin: "file: …", "derived: …" or "assumed: …".
        is_open: Whether the user must decide it, because no file contains it.
    """

    numbers: np.ndarray
    origin: str
    is_open: bool = False


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Limits of J joints, ±inf for no limit. Ranges are (J, 2), all other vectors (J,)."""

    ranges: np.ndarray
    torques: Value
    velocities: Value
    accelerations: Value
    jerks: Value


def find_limits(
    model: mujoco.MjModel, joints: list[int], qpos: np.ndarray, urdf: Mapping[str, UrdfJoint]
) -> JointLimits:
    """Return the limits of the arm's joints; the rest of the model is at `qpos` (nq,)."""
    ranges = model_ranges(model, joints)
    torques = _torques(model, joints, bool(urdf))
    velocities = _velocities(model, joints, urdf)
    accelerations = _accelerations(model, joints, qpos, torques.numbers, velocities.numbers)
    jerks = round_down(accelerations.numbers / JERK_S)
    return JointLimits(
        ranges, torques, velocities, accelerations, Value(jerks, f"derived: full acceleration in {JERK_S:g} s")
    )


def round_down(values: np.ndarray) -> np.ndarray:
    """Return positive values rounded down to two digits."""
    scale = 10.0 ** (np.floor(np.log10(values)) - 1)
    return np.round(np.floor(values / scale + 1e-9) * scale, 6)


def _torques(model: mujoco.MjModel, joints: Sequence[int], is_urdf: bool) -> Value:
    limits = np.array([torque_limit(model, joint) for joint in joints])
    if np.isfinite(limits).all():
        return Value(limits, "file: effort" if is_urdf else "file: ranges of force")
    return Value(limits, "no file has all, inf is unknown; see the data sheet", is_open=True)


def _velocities(model: mujoco.MjModel, joints: Sequence[int], urdf: Mapping[str, UrdfJoint]) -> Value:
    slide = int(mujoco.mjtJoint.mjJNT_SLIDE)
    assumed = np.array(
        [ASSUMED_SLIDE_VELOCITY if model.jnt_type[joint] == slide else ASSUMED_VELOCITY for joint in joints]
    )
    if not urdf:
        return Value(assumed, "assumed, no MJCF has them; rad/s, see the data sheet", is_open=True)
    found = [urdf[model.joint(joint).name] for joint in joints]
    usable = np.array([joint.velocity is not None and joint.velocity > 0 for joint in found])
    values = np.where(usable, [joint.velocity or 0.0 for joint in found], assumed)
    if usable.all():
        return Value(values, "file: velocity")
    missing = ", ".join(joint.name for joint, has in zip(found, usable, strict=True) if not has)
    return Value(values, f"file: velocity, but assumed for {missing}; rad/s, see the data sheet", is_open=True)


def _accelerations(
    model: mujoco.MjModel, joints: list[int], qpos: np.ndarray, torques: np.ndarray, velocities: np.ndarray
) -> Value:
    """Return the accelerations that the torques allow beyond gravity, friction and damping, for the worst coupling."""
    load = load_at(model, qpos, joints, sample_poses(model_ranges(model, joints)))
    dofs = model.jnt_dofadr[joints]
    known = np.isfinite(torques)
    damping = model.dof_damping.reshape(model.nv, -1)[dofs, 0]
    lost = model.dof_frictionloss[dofs] + damping * velocities + np.abs(load.gravity)
    spare = np.where(known, torques, 0.0) - lost
    reached = np.quantile(spare / np.abs(load.inertia).sum(axis=2), QUANTILE, axis=0)
    reached = np.where(known, reached, np.inf)
    highest = velocities / np.where(known, SPEED_UP_S, ASSUMED_SPEED_UP_S)
    lowest = velocities  # a joint whose torque hardly holds it is given at least this: full speed in a second
    values = round_down(np.clip(reached, lowest, highest))
    rule = f"(torque - gravity) / inertia in {1 - QUANTILE:.0%} of poses, full speed in {SPEED_UP_S:g} s at least"
    if known.all():
        return Value(values, f"derived: {rule}")
    return Value(values, f"assumed where no torque is known: full speed in {ASSUMED_SPEED_UP_S:g} s")
