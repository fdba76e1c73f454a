"""The ball, the racket's face and the court: tables of a robot's TOML, checked against its model."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from robot.model import FREE
from robot.schema import BallTable, CourtTable, RacketTable, RobotError

BALL = "ball"
TEE = "tee"
"""Bodies known by name, both optional: a ball with a free joint, and a mocap body whose origin is its top."""
_CYLINDER, _BOX, _PLANE = (int(getattr(mujoco.mjtGeom, f"mjGEOM_{kind}")) for kind in ("CYLINDER", "BOX", "PLANE"))


@dataclass(frozen=True, slots=True)
class BallConfig:
    """The model's body `ball`, which has a free joint.

    mass, radius: kg, m. drag, magnus: coefficients of a = −drag·|v|·v + magnus·ω × v, 1/m and 1. every: ticks from one
    measurement of the ball to the next. rate_hz: measurements a second.
    """

    mass: float
    radius: float
    drag: float
    magnus: float
    every: int
    rate_hz: float


@dataclass(frozen=True, slots=True)
class RacketConfig:
    """The face of the racket: a disc of `radius` and half `thickness`, m, whose middle and normal are the tool's.

    restitution, friction: initial estimates for the contact, before learning.
    """

    geom: str
    radius: float
    thickness: float
    restitution: float
    friction: float


@dataclass(frozen=True, slots=True)
class NetConfig:
    """The net. top: middle of its upper edge (3,), m. normal: horizontal unit vector (2,). half_width: m."""

    geom: str
    top: tuple[float, float, float]
    normal: tuple[float, float]
    half_width: float


@dataclass(frozen=True, slots=True)
class CourtConfig:
    """The surface on which balls bounce, and the net.

    surface: its geom's name. height: height of its top, m. restitution, friction, dwell: initial estimates for a
    bounce, see `CourtTable`. region: ((x, x), (y, y)), m, where a returned ball must land; ±inf for no bound.
    """

    surface: str
    height: float
    net: NetConfig | None
    restitution: float
    friction: float
    dwell: float
    region: tuple[tuple[float, float], tuple[float, float]]


def ball_config(table: BallTable | None, model: mujoco.MjModel, robot_hz: float) -> BallConfig | None:
    """Return the ball of the model, or None without one.

    Raises:
        RobotError: the table has a value out of range, or the model has no ball.
    """
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, BALL)
    joint = model.body_jntadr[body] if body >= 0 else -1
    if joint < 0 or model.jnt_type[joint] != FREE:
        if table is not None:
            raise RobotError(f"ball: the model has no body {BALL!r} with a free joint; add one, or remove the table")
        return None
    table = table or BallTable()
    _check("ball", table, ("drag", "magnus"), 0.0, np.inf)
    if not 1 <= table.rate_hz <= robot_hz:
        raise RobotError(f"ball.rate_hz: {table.rate_hz:g} must be at least 1 and at most rate_hz = {robot_hz:g}")
    every = max(1, round(robot_hz / table.rate_hz))
    radius = float(model.geom_size[model.body_geomadr[body], 0])
    return BallConfig(float(model.body_mass[body]), radius, table.drag, table.magnus, every, robot_hz / every)


def racket_config(table: RacketTable | None, model: mujoco.MjModel, bodies: Sequence[int]) -> RacketConfig | None:
    """Return the racket's face, or None if the table names none; `bodies` are those that the joints move.

    Raises:
        RobotError: the geom is missing, of another shape or not on the arm, or a value is out of range.
    """
    if table is None or table.geom is None:
        return None
    geom = _geom(model, table.geom, "racket.geom")
    if model.geom_bodyid[geom] not in bodies:
        raise RobotError(f"racket.geom: none of joints.names moves {table.geom!r}; name the face of the arm's racket")
    _check("racket", table, ("restitution", "friction"), 0.0, 1.0)
    size, kind = np.sort(model.geom_size[geom]), int(model.geom_type[geom])
    if kind == _CYLINDER:
        radius, thickness = model.geom_size[geom, :2].tolist()
    elif kind == _BOX:
        thickness, radius = size[:2].tolist()
    else:
        raise RobotError(f"racket.geom: {table.geom!r} is neither a cylinder nor a box; give the face one of these")
    return RacketConfig(table.geom, radius, thickness, table.restitution, table.friction)


def court_config(table: CourtTable | None, model: mujoco.MjModel) -> CourtConfig | None:
    """Return the court, or None without the table.

    Raises:
        RobotError: a geom is missing, moves or has another shape, or a value is out of range.
    """
    if table is None:
        return None
    _check("court", table, ("restitution", "friction"), 0.0, 1.0)
    _check("court", table, ("dwell",), 0.0, 0.1)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    surface = _fixed(model, table.surface, "court.surface")
    place, half = data.geom_xpos[surface], _half_extent(model, data, surface)
    if model.geom_type[surface] == _PLANE:
        half = np.array([np.inf, np.inf, 0.0])
    elif model.geom_type[surface] != _BOX:
        raise RobotError(f"court.surface: {table.surface!r} is neither a plane nor a box; give it one of these shapes")
    extent = tuple((float(place[i] - half[i]), float(place[i] + half[i])) for i in (0, 1))
    region = table.region or extent
    for name, (low, high) in zip("xy", region, strict=True):
        if not low < high:
            raise RobotError(f"court.region: its {name} goes from {low:g} to {high:g} m; write the smaller one first")
    net = None if table.net is None else _net(model, data, table.net)
    believed = table.restitution, table.friction, table.dwell
    return CourtConfig(table.surface, float(place[2] + half[2]), net, *believed, region)  # type: ignore[arg-type]


def _net(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> NetConfig:
    geom = _fixed(model, name, "court.net")
    if model.geom_type[geom] != _BOX:
        raise RobotError(f"court.net: {name!r} is not a box; make the net a thin one")
    rotation, size = data.geom_xmat[geom].reshape(3, 3), model.geom_size[geom]
    level = sorted((axis for axis in range(3) if abs(rotation[2, axis]) < 0.01), key=lambda axis: size[axis])
    if len(level) != 2:
        raise RobotError(f"court.net: {name!r} leans; let one of its axes be vertical")
    thin, wide = level
    x, y, z = data.geom_xpos[geom].tolist()
    top = z + float(_half_extent(model, data, geom)[2])
    normal = float(rotation[0, thin]), float(rotation[1, thin])
    return NetConfig(name, (x, y, top), normal, float(size[wide]))


def _half_extent(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> np.ndarray:
    """Return half of the extent (3,) of a box along the world's axes, m."""
    return np.abs(data.geom_xmat[geom].reshape(3, 3)) @ model.geom_size[geom]


def _geom(model: mujoco.MjModel, name: str, key: str) -> int:
    geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
    if geom < 0:
        names = ", ".join(filter(None, (model.geom(i).name for i in range(model.ngeom)))) or "none"
        raise RobotError(f"{key}: the model has no geom {name!r}; those that touch something and have a name: {names}")
    return geom


def _fixed(model: mujoco.MjModel, name: str, key: str) -> int:
    geom = _geom(model, name, key)
    if model.body_weldid[model.geom_bodyid[geom]] != 0:
        raise RobotError(f"{key}: {name!r} moves; the court must be fixed to the world")
    return geom


def _check(key: str, table: object, names: Sequence[str], low: float, high: float) -> None:
    for name in names:
        value = getattr(table, name)
        if not low <= value <= high or value == np.inf:
            bounds = f"{low:g} to {high:g}" if np.isfinite(high) else f"{low:g} or more"
            raise RobotError(f"{key}.{name}: {value} must be {bounds}")
