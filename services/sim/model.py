"""The MuJoCo model the simulation runs: where the arm, the ball and the tee lie in its arrays."""

import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from robot.court import BALL, TEE
from robot.description import RobotConfig
from robot.model import joint_ids


@dataclass(frozen=True, slots=True)
class FreeBall:
    """Where the ball lies in `qpos` and `qvel`: position (3) then quaternion, linear (3) then angular."""

    body: int
    qpos: int
    dof: int
    radius: float


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A model prepared for one tick of 1/rate_hz at a time, with its data.

    qpos, dofs: addresses (J,) of the arm's joints. substeps: physics steps a tick. tee: mocap index.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    qpos: np.ndarray
    dofs: np.ndarray
    substeps: int
    ball: FreeBall | None
    tee: int | None


def build_scene(config: RobotConfig) -> Scene:
    """The robot's scene.

    The arm is moved by generalised forces and the model's own actuators are off, so that a model whose
    actuators are position servos serves as well. Damping is explicit, so that inverse dynamics, which
    compensates it, does so exactly. A state that diverges is not silently reset.
    """
    model = config.load_model()
    substeps = max(1, math.ceil(config.tick / model.opt.timestep - 1e-9))
    model.opt.timestep = config.tick / substeps
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    for flag in ("ACTUATION", "EULERDAMP", "AUTORESET"):
        model.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}"))
    return Scene(
        model=model,
        data=mujoco.MjData(model),
        **_addresses(model, config),
        substeps=substeps,
        ball=_find_ball(model) if config.ball else None,
        tee=_find_tee(model),
    )


def arm_in(scene: Scene, config: RobotConfig) -> Scene:
    """The same scene, as another robot that stands in it has it: with the addresses of that robot's joints."""
    return replace(scene, **_addresses(scene.model, config))


def _addresses(model: mujoco.MjModel, config: RobotConfig) -> dict[str, np.ndarray]:
    ids = joint_ids(model, config.joint_names)
    # numpy picks by intp several times as fast as by MuJoCo's int32.
    return {"qpos": model.jnt_qposadr[ids].astype(np.intp), "dofs": model.jnt_dofadr[ids].astype(np.intp)}


def _find_ball(model: mujoco.MjModel) -> FreeBall:
    body = model.body(BALL).id
    joint = model.body_jntadr[body]
    radius = float(model.geom_size[model.body_geomadr[body], 0])
    return FreeBall(body, int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint]), radius)


def _find_tee(model: mujoco.MjModel) -> int | None:
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, TEE)
    return int(model.body_mocapid[body]) if body >= 0 and model.body_mocapid[body] >= 0 else None
