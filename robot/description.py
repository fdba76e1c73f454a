"""The robot's description: a TOML file beside an MJCF model."""

from dataclasses import dataclass
from pathlib import Path

import msgspec
import mujoco
import numpy as np

from motion.limits import Limits
from robot.shipped import DEFAULT_ROBOT_CONFIG


class RobotError(ValueError):
    """An invalid robot description; `str()` names the file, the key and what would work."""


class _Joints(msgspec.Struct, forbid_unknown_fields=True):
    """Table `joints` of the TOML, in the order of every vector on the wire."""

    names: list[str]
    home: list[float]
    velocities: list[float]
    accelerations: list[float]
    jerks: list[float]


class _Description(msgspec.Struct, forbid_unknown_fields=True):
    """The TOML file."""

    name: str
    model: str
    tool_site: str
    rate_hz: float
    alpha: float
    silence_ticks: int
    max_tracking_error: float
    joints: _Joints


@dataclass(frozen=True, slots=True, eq=False)
class RobotConfig:
    """The validated description of a robot of J joints, in the order of `joint_names`.

    home: (J,), rad. limits: positions from the model, the rest from the TOML; ±inf where the model has none.
    torques: (J,), N·m, the largest of either sign, inf where the model has none. alpha: gain of eq. 11, 1/s.
    rate_hz: ticks per second. silence_ticks: ticks without a fresh command before the arm brakes.
    max_tracking_error: rad, on any joint. tool_site: the racket's centre in the model, its z axis the
    striking face's normal.
    """

    name: str
    joint_names: tuple[str, ...]
    home: np.ndarray
    limits: Limits
    torques: np.ndarray
    alpha: float
    rate_hz: float
    silence_ticks: int
    max_tracking_error: float
    tool_site: str
    mjcf_path: Path

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return len(self.joint_names)

    @property
    def tick(self) -> float:
        """Length of a tick, s."""
        return 1.0 / self.rate_hz

    def load_model(self) -> mujoco.MjModel:
        """Load the MuJoCo model of the robot and its surroundings."""
        return mujoco.MjModel.from_xml_path(str(self.mjcf_path))


def load_robot(path: Path | str = DEFAULT_ROBOT_CONFIG) -> RobotConfig:
    """Return the robot that the TOML file at `path` describes. Raises RobotError."""
    path = Path(path)
    try:
        description = msgspec.toml.decode(path.read_bytes(), type=_Description)
    except OSError as error:
        raise RobotError(f"{path}: cannot be read ({error.strerror}); name a robot's TOML file") from error
    except msgspec.DecodeError as error:
        raise RobotError(f"{path}: {error}") from error
    mjcf_path = path.parent / description.model
    try:
        model = mujoco.MjModel.from_xml_path(str(mjcf_path))
    except ValueError as error:
        raise RobotError(f"{path}: model {description.model!r} cannot be loaded: {error}") from error
    try:
        return _config(description, model, mjcf_path)
    except RobotError as error:
        raise RobotError(f"{path}: {error}") from error


def joint_ids(model: mujoco.MjModel, names: tuple[str, ...]) -> list[int]:
    """Return the indices of the named joints. Raises RobotError for a joint that is missing or has several axes."""
    # MuJoCo's enumeration members do not compare equal to the numbers in its arrays.
    single_axis = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    available = [model.joint(i).name for i in range(model.njnt) if model.jnt_type[i] in single_axis]
    for name in names:
        if name not in available:
            raise RobotError(f"joints.names: the model has no joint {name!r}; it has {', '.join(available)}")
    return [model.joint(name).id for name in names]


def _config(description: _Description, model: mujoco.MjModel, mjcf_path: Path) -> RobotConfig:
    """Validate a description against its model."""
    joints = description.joints
    names = tuple(joints.names)
    if not names or len(set(names)) < len(names):
        raise RobotError("joints.names: needs one or more names, each once")
    for key in ("rate_hz", "alpha", "silence_ticks", "max_tracking_error"):
        value = getattr(description, key)
        if not 0 < value < np.inf:
            raise RobotError(f"{key}: {value} is not a finite number greater than 0")
    ids = joint_ids(model, names)
    _check_site(model, description.tool_site)
    positions = np.where(model.jnt_limited[ids, None], model.jnt_range[ids], [-np.inf, np.inf])
    return RobotConfig(
        name=description.name,
        joint_names=names,
        home=_home(joints, positions),
        limits=Limits(positions, *(_bounds(joints, key) for key in ("velocities", "accelerations", "jerks"))),
        torques=np.array([_torque_limit(model, joint) for joint in ids]),
        alpha=description.alpha,
        rate_hz=description.rate_hz,
        silence_ticks=description.silence_ticks,
        max_tracking_error=description.max_tracking_error,
        tool_site=description.tool_site,
        mjcf_path=mjcf_path,
    )


def _vector(joints: _Joints, key: str) -> np.ndarray:
    """Return a vector of the table, (J,)."""
    values = np.array(getattr(joints, key), dtype=float)
    if len(values) != len(joints.names):
        raise RobotError(f"joints.{key}: has {len(values)} values for {len(joints.names)} joints")
    return values


def _bounds(joints: _Joints, key: str) -> np.ndarray:
    """Return a vector of symmetric limits, (J,); inf is allowed."""
    values = _vector(joints, key)
    for name, value in zip(joints.names, values, strict=True):
        if not value > 0:
            raise RobotError(f"joints.{key}: {name}: {value} is not greater than 0")
    return values


def _home(joints: _Joints, positions: np.ndarray) -> np.ndarray:
    """Return the home pose, (J,), checked against the ranges (J, 2)."""
    home = _vector(joints, "home")
    for name, value, (low, high) in zip(joints.names, home, positions, strict=True):
        if not (low <= value <= high and np.isfinite(value)):
            raise RobotError(f"joints.home: {name}: {value} lies outside its range {low:.6g} to {high:.6g}")
    return home


def _check_site(model: mujoco.MjModel, name: str) -> None:
    sites = [model.site(i).name for i in range(model.nsite)]
    if name not in sites:
        raise RobotError(f"tool_site: the model has no site {name!r}; it has {', '.join(sites) or 'none'}")


def _torque_limit(model: mujoco.MjModel, joint: int) -> float:
    """Return the largest torque (N·m) in either direction, from the limits of the joint and of its actuators."""
    limit = np.inf
    if model.jnt_actfrclimited[joint]:
        limit = np.abs(model.jnt_actfrcrange[joint]).min()
    drives = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    for actuator in range(model.nu):
        if model.actuator_trntype[actuator] not in drives or model.actuator_trnid[actuator, 0] != joint:
            continue
        gear = abs(model.actuator_gear[actuator, 0])
        if model.actuator_forcelimited[actuator]:
            limit = min(limit, gear * np.abs(model.actuator_forcerange[actuator]).min())
        if _is_motor(model, actuator) and model.actuator_ctrllimited[actuator]:
            limit = min(limit, gear * np.abs(model.actuator_ctrlrange[actuator]).min())
    return float(limit)


def _is_motor(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether the control of the actuator is its force, so that both have the same range."""
    return (
        model.actuator_gaintype[actuator] == int(mujoco.mjtGain.mjGAIN_FIXED)
        and model.actuator_biastype[actuator] == int(mujoco.mjtBias.mjBIAS_NONE)
        and model.actuator_gainprm[actuator, 0] == 1.0
    )
