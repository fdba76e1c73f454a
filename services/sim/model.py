"""The simulation's MuJoCo model, with the addresses of the arm, the ball and the tee in its arrays."""

import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from robot.court import BALL, TEE
from robot.description import RobotConfig
from robot.model import joint_ids


@dataclass(frozen=True, slots=True)
class FreeBall:
    """The ball, a free body.

    Attributes:
        body: Index of the body.
        qpos: Address in `qpos` of its position (3,), followed by its quaternion (4,).
        dof: Address in `qvel` of its velocity (3,), followed by its angular velocity (3,).
        radius: Radius, m.
    """

    body: int
    qpos: int
    dof: int
    radius: float


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A model and its data, simulated tick by tick.

    Attributes:
        model: The model; its time step is a tick divided by `substeps`.
        data: The state of the simulation.
        qpos: Addresses (J,) of the arm's joints in `qpos`.
        dofs: Addresses (J,) of the arm's joints in `qvel`.
        substeps: Number of physics steps in a tick.
        ball: The ball; None without one.
        tee: Mocap index of the tee; None without one.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    qpos: np.ndarray
    dofs: np.ndarray
    substeps: int
    ball: FreeBall | None
    tee: int | None


def build_scene(config: RobotConfig) -> Scene:
    """Load a robot's model and prepare it for simulation.

    Generalised forces move the arm and the model's actuators are disabled, so that models with position servos can be
    used. Damping is integrated explicitly, so that inverse dynamics compensates it exactly. MuJoCo's automatic reset of
    a diverged state is disabled.
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


def scene_of(scene: Scene, config: RobotConfig) -> Scene:
    """Return a scene, which shares model and data, with the addresses of another robot's joints."""
    return replace(scene, **_addresses(scene.model, config))


def _addresses(model: mujoco.MjModel, config: RobotConfig) -> dict[str, np.ndarray]:
    ids = joint_ids(model, config.joint_names)
    # Indexing by intp is several times as fast as by MuJoCo's int32.
    return {"qpos": model.jnt_qposadr[ids].astype(np.intp), "dofs": model.jnt_dofadr[ids].astype(np.intp)}


def _find_ball(model: mujoco.MjModel) -> FreeBall:
    body = model.body(BALL).id
    joint = model.body_jntadr[body]
    radius = float(model.geom_size[model.body_geomadr[body], 0])
    return FreeBall(body, int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint]), radius)


def _find_tee(model: mujoco.MjModel) -> int | None:
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, TEE)
    return int(model.body_mocapid[body]) if body >= 0 and model.body_mocapid[body] >= 0 else None
