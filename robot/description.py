"""The robot's description: a TOML file beside an MJCF or URDF model."""

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass
from pathlib import Path

import msgspec
import mujoco
import numpy as np

from motion.limits import Limits
from robot.court import BallConfig, CourtConfig, RacketConfig, ball_config, court_config, racket_config
from robot.joints import bounds, home, inside, model_ranges, ranges, torques
from robot.model import TOOL_SITE, Tool, body_name, check_tool, compile_model, is_slide, joint_ids
from robot.schema import (
    CollisionTable,
    Description,
    OnFault,
    RecoilBounds,
    RobotError,
    Tolerance,
    ToolFrame,
    read_description,
)
from robot.shipped import DEFAULT_ROBOT_CONFIG
from robot.tree import is_moved_by
from robot.urdf import UrdfJoint, read_urdf

MAX_GAIN = 2.0
"""Eq. 11 is unstable if alpha·tick is larger."""


@dataclass(frozen=True, slots=True)
class Collision:
    """The smallest distance (m) that plans keep between bodies, and the pairs of bodies that may touch."""

    margin: float
    ignore: frozenset[frozenset[str]]


@dataclass(frozen=True, slots=True, eq=False)
class RobotConfig:
    """The validated description of a robot of J joints, in the order of `joint_names`.

    home: (J,), rad. limits: positions from the model or tighter, the rest from the TOML; ±inf for no limit.
    torques: (J,), N·m, largest magnitude, inf for no limit. alpha: gain of eq. 11, 1/s.
    rate_hz: ticks per second. silence_ticks: ticks without a fresh command before the arm brakes.
    max_tracking_error: rad, on any joint. on_fault: reaction to a larger error: hold the measured pose, or stop along
    the reference. tolerance: default tolerance of goals. tool: its frame; for a racket the centre, with the z axis
    normal to the striking face. bodies: names of the bodies that the joints move. held: joints that are not the arm's,
    and the value (rad, m) at which each is held.
    recoil: bounds of a hit's recoil, None if a recoil is a fault.
    others: other robots on the bus that stand in the model: their joints, in the order of their own vectors.
    ball, racket, court: equipment for ball games, each None if absent.
    urdf: the joints of a URDF by name; empty for an MJCF.
    model: MuJoCo model of the robot and its surroundings, with the tool's site, without geoms that cannot collide;
    read-only.
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
    on_fault: OnFault
    tolerance: Tolerance
    tool: Tool
    bodies: frozenset[str]
    held: Mapping[str, float]
    others: Mapping[str, tuple[str, ...]]
    collision: Collision
    recoil: RecoilBounds | None
    ball: BallConfig | None
    racket: RacketConfig | None
    court: CourtConfig | None
    mjcf_path: Path
    urdf: Mapping[str, UrdfJoint]
    model: mujoco.MjModel

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return len(self.joint_names)

    @property
    def tick(self) -> float:
        """Duration of a tick, s."""
        return 1.0 / self.rate_hz

    @property
    def slides(self) -> tuple[bool, ...]:
        """Which joints slide, in m and N instead of rad and N·m."""
        return tuple(is_slide(self.model, joint) for joint in joint_ids(self.model, self.joint_names))

    @property
    def pose_at_home(self) -> np.ndarray:
        """Positions (nq,) of the whole model: the arm at home, held joints at their values, the rest as modelled."""
        pose = self.model.qpos0.copy()
        joints = joint_ids(self.model, (*self.joint_names, *self.held))
        pose[self.model.jnt_qposadr[joints]] = [*self.home, *self.held.values()]
        return pose

    def load_model(self, visual: bool = False) -> mujoco.MjModel:
        """Return a copy of the model; `visual`: with visual geometry."""
        return compile_model(self.mjcf_path, self.tool, self.urdf, visual) if visual else copy(self.model)


def load_robot(path: Path | str = DEFAULT_ROBOT_CONFIG) -> RobotConfig:
    """Return the robot that the TOML file at `path` describes. Raises RobotError."""
    path = Path(path)
    description = read_description(path)
    mjcf_path = path.parent / description.model
    try:
        return _config(description, mjcf_path, _tool(description), read_urdf(mjcf_path))
    except RobotError as error:
        raise RobotError(f"{path}: {error}") from error


def _config(description: Description, mjcf_path: Path, tool: Tool, urdf: Mapping[str, UrdfJoint]) -> RobotConfig:
    """Validate a description against its model."""
    model = compile_model(mjcf_path, tool, urdf)
    joints = description.joints
    names = tuple(joints.names)
    if not names or len(set(names)) < len(names):
        raise RobotError("joints.names: needs one or more names, each once")
    ids = joint_ids(model, names)
    _check_numbers(description)
    moved = [body for body in range(1, model.nbody) if is_moved_by(model, body, set(ids))]
    check_tool(model, tool, moved)
    positions = ranges(joints, model, ids)
    return RobotConfig(
        name=description.name,
        joint_names=names,
        home=home(joints, model, ids, positions),
        limits=Limits(positions, *(bounds(joints, key) for key in ("velocities", "accelerations", "jerks"))),
        torques=torques(joints, model, ids),
        alpha=description.alpha,
        rate_hz=description.rate_hz,
        silence_ticks=description.silence_ticks,
        max_tracking_error=description.max_tracking_error,
        on_fault=description.on_fault,
        tolerance=_tolerance(description),
        tool=tool,
        bodies=frozenset(body_name(model, body) for body in moved),
        held=_held(description, model),
        others=_others(description, model),
        collision=_collision(description.collision, model),
        recoil=_recoil(description),
        ball=ball_config(description.ball, model, description.rate_hz),
        racket=racket_config(description.racket, model, moved),
        court=court_config(description.court, model),
        mjcf_path=mjcf_path,
        urdf=urdf,
        model=model,
    )


def _check_numbers(description: Description) -> None:
    for key in ("rate_hz", "alpha", "silence_ticks", "max_tracking_error"):
        value = getattr(description, key)
        if not 0 < value < np.inf:
            raise RobotError(f"{key}: {value} is not a finite number greater than 0")
    largest = MAX_GAIN * description.rate_hz
    if description.alpha > largest:
        raise RobotError(
            f"alpha: {description.alpha:g} makes tracking unstable at {description.rate_hz:g} ticks a second; "
            f"it must be at most {largest:g}, and a tenth of that tracks well"
        )


def _tool(description: Description) -> Tool:
    tool = description.tool
    if not isinstance(tool, ToolFrame):
        return Tool(tool)
    if not np.isfinite(tool.position).all():
        raise RobotError(f"tool.position: {list(tool.position)} is not finite")
    length = float(np.linalg.norm(tool.quaternion))
    if not 0 < length < np.inf:
        raise RobotError(
            f"tool.quaternion: {list(tool.quaternion)} is not a rotation; write [1, 0, 0, 0] for the body's own axes"
        )
    return Tool(TOOL_SITE, tool.body, tool.position, tool.quaternion)


def _tolerance(description: Description) -> Tolerance:
    for key, value in msgspec.structs.asdict(description.tolerance).items():
        if not value > 0:
            raise RobotError(f"tolerance.{key}: {value} is not greater than 0")
    return description.tolerance


def _recoil(description: Description) -> RecoilBounds | None:
    if description.racket is None or description.racket.recoil is None:
        return None
    bounds, largest = description.racket.recoil, description.max_tracking_error
    for key, value in msgspec.structs.asdict(bounds).items():
        if not 0 < value < np.inf:
            raise RobotError(f"racket.recoil.{key}: {value} is not a finite number greater than 0")
    if not bounds.tolerance < largest < bounds.positions:
        raise RobotError(
            f"racket.recoil: max_tracking_error = {largest:g} must lie between tolerance = {bounds.tolerance:g} and "
            f"positions = {bounds.positions:g}; an error below it is not a fault at any time"
        )
    return bounds


def _held(description: Description, model: mujoco.MjModel) -> dict[str, float]:
    """Return the held joints, checked against their ranges."""
    held = description.held
    bounds = model_ranges(model, joint_ids(model, tuple(held), "held"))
    for name, value, own in zip(held, held.values(), bounds, strict=True):
        if name in description.joints.names:
            raise RobotError(f"held.{name}: is one of joints.names, which move; leave it out here or there")
        held[name] = inside(f"held.{name}", value, own)
    return held


def _others(description: Description, model: mujoco.MjModel) -> dict[str, tuple[str, ...]]:
    """Return the joints of each other robot that stands in the model; `held` must have the initial value of each."""
    others = {name: tuple(joints) for name, joints in description.others.items()}
    for name, joints in others.items():
        joint_ids(model, joints, f"others.{name}")
        free = [joint for joint in joints if joint not in description.held]
        if free:
            raise RobotError(f"others.{name}: {free[0]} has no value in held; give it the one at which it begins")
    return others


def _collision(table: CollisionTable, model: mujoco.MjModel) -> Collision:
    if not 0 <= table.margin < np.inf:
        raise RobotError(f"collision.margin: {table.margin} is not a finite number of 0 or more")
    bodies = {model.body(i).name for i in range(model.nbody)}
    for name in {name for pair in table.ignore for name in pair} - bodies:
        raise RobotError(f"collision.ignore: the model has no body {name!r}; it has {', '.join(sorted(bodies))}")
    return Collision(table.margin, frozenset(map(frozenset, table.ignore)))
