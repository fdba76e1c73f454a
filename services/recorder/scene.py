"""Poses of the bodies in the picture: kinematics of the robot's model."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain, product

import mujoco
import numpy as np
import rerun as rr

from robot.compilation import give_back_memory
from robot.court import BALL, TEE
from robot.description import RobotConfig
from robot.model import body_name, joint_ids
from robot.surroundings import Surroundings
from robot.tree import is_moved_by
from services.recorder import entities
from services.recorder.geometry import Geometry
from services.recorder.writer import TraceWriter

MARGIN = 1.8
"""Half the size of an infinite plane, in radii of the view."""
Joints = Mapping[str, list[float]]


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Bounding sphere of the arm at home, with other robots of its scene: centre (3,) and radius, m."""

    centre: np.ndarray
    radius: float


class Scene:
    """The model with its own data.

    Attributes:
        names: Names of all bodies, as parts of their paths.
        arm: Bodies that the arm's joints move.
        others: Bodies that only other joints move, for example another arm; without the ball.
    """

    def __init__(self, config: RobotConfig) -> None:
        self.model = config.model
        self._config = config
        self._data = mujoco.MjData(self.model)
        self._joints = joint_ids(self.model, config.joint_names)
        self._qpos = self.model.jnt_qposadr[self._joints]
        self._tool = self.model.site(config.tool.site).id
        self._surroundings = Surroundings(config, self.model)
        self._coming: deque[tuple[float, Joints]] = deque()
        self._later: dict[str, list[tuple[str, tuple[rr.AsComponents, ...]]]] = {}
        self.names = _paths(self.model)
        self.arm = self._moved_by(set(self._joints))
        moving = [body for body in self._moved_by(set(range(self.model.njnt))) if body not in self.arm]
        self.others = [body for body in moving if self.model.body(body).name != BALL]
        self._surroundings.place(self._data, {name: [value] for name, value in config.held.items()})
        self._place(config.home)

    def radius_of(self, name: str) -> float:
        """Return the radius (m) of a body's first geom, 0 without one."""
        body = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, name)
        geom = self.model.body_geomadr[body] if body >= 0 else -1
        return float(self.model.geom_size[geom, 0]) if geom >= 0 else 0.0

    def expect(self, surroundings: list[tuple[float, Joints]]) -> None:
        """Set the motion of other joints, by times (s), for the poses of the next batch, in place of the last one's."""
        self._coming = deque(surroundings)

    def body_poses(
        self, positions: np.ndarray, times: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the poses of the arm's B bodies at joint positions (N, J), rad.

        `times` (N,), s: at which other joints on the arm, for example of a gripper, are taken.

        Returns positions (N, B, 3), m, quaternions (N, B, 4), x first, and the tool's positions (N, 3), m.
        """
        places = np.empty((len(positions), len(self.arm), 3))
        turns = np.empty((len(positions), len(self.arm), 4))
        tools = np.empty((len(positions), 3))
        for index, pose in enumerate(positions):
            while times is not None and self._coming and self._coming[0][0] <= times[index]:
                self._surroundings.place(self._data, self._coming.popleft()[1])
            self._place(pose)
            places[index], turns[index] = self._poses(self.arm)
            tools[index] = self._data.site_xpos[self._tool]
        return places, turns, tools

    def other_poses(self, joints: Joints) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (B, 3), m, and quaternions (B, 4), x first, of the other bodies."""
        self._surroundings.place(self._data, joints)
        mujoco.mj_kinematics(self.model, self._data)
        return self._poses(self.others)

    def tool_path(self, positions: np.ndarray) -> np.ndarray:
        """Return the tool's positions (N, 3), m, at joint positions (N, J), rad."""
        return self.body_poses(positions)[2]

    def push_arrow(self, joint: int, positions: np.ndarray) -> tuple[str, np.ndarray, np.ndarray]:
        """Return the tool's motion by a positive push on a joint: the body, a point and a unit direction in its frame.

        If the tool is on the joint's axis, the direction is the axis.
        """
        self._place(positions)
        model, data = self.model, self._data
        body = int(model.jnt_bodyid[self._joints[joint]])
        axis, tool = data.xaxis[self._joints[joint]], data.site_xpos[self._tool]
        direction = np.cross(axis, tool - data.xanchor[self._joints[joint]])
        reach = np.linalg.norm(direction)
        direction = direction / reach if reach > 0.02 else axis
        to_body = data.xmat[body].reshape(3, 3).T
        return self.names[body], to_body @ (tool - data.xpos[body]), to_body @ direction

    def view(self) -> View:
        """Return the bounding sphere for the view."""
        self._place(self._config.home)
        others = joint_ids(self.model, tuple(chain.from_iterable(self._config.others.values())))
        roots = set(self.model.body_rootid[[*self.arm, *self.model.jnt_bodyid[others]]].tolist())
        bodies = [body for body in range(1, self.model.nbody) if self.model.body_rootid[body] in roots]
        corners = [self._data.xpos[body] for body in bodies]
        signs = np.array(list(product((-1, 1), repeat=3)))
        for geom in np.flatnonzero(np.isin(self.model.geom_bodyid, bodies)):
            centre, half = self.model.geom_aabb[geom, :3], self.model.geom_aabb[geom, 3:]
            rotation = self._data.geom_xmat[geom].reshape(3, 3)
            corners.extend(self._data.geom_xpos[geom] + (centre + signs * half) @ rotation.T)
        low, high = np.min(corners, axis=0), np.max(corners, axis=0)
        return View((low + high) / 2, float(np.linalg.norm(high - low)) / 2)

    def write_geometry(self, trace: TraceWriter) -> None:
        """Write all geometry except ball and tee, which are written when a ball is published."""
        trace.static(entities.WORLD.path, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        self._write_shapes(trace)
        trace.flush()
        give_back_memory()  # of the visual model

    def _write_shapes(self, trace: TraceWriter) -> None:
        view = self.view()
        geometry = Geometry(self._config.load_model(visual=True), view.centre, MARGIN * view.radius)
        moving = {*self.arm, *self.others}
        for body, path in enumerate(self.names):
            name = self.model.body(body).name
            if name in (BALL, TEE):
                self._later[name] = list(geometry.shapes(body))
                continue
            for part, shape in geometry.shapes(body):
                trace.static(entities.SHAPE.at(path, part) if body else entities.WORLD_SHAPE.at(part), *shape)
            if body and body not in moving:
                turn = rr.Quaternion(xyzw=np.roll(self._data.xquat[body], -1))
                trace.static(
                    entities.FIXED_BODY.at(path), rr.Transform3D(translation=self._data.xpos[body], quaternion=turn)
                )

    def write_body(self, trace: TraceWriter, name: str) -> None:
        """Write the geometry of ball or tee, if the model has the body."""
        for part, shape in self._later.pop(name, []):
            trace.static(entities.SHAPE.at(name, part), *shape)

    def _moved_by(self, joints: set[int]) -> list[int]:
        return [body for body in range(1, self.model.nbody) if is_moved_by(self.model, body, joints)]

    def _place(self, positions: np.ndarray) -> None:
        self._data.qpos[self._qpos] = positions
        mujoco.mj_kinematics(self.model, self._data)

    def _poses(self, bodies: list[int]) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and quaternions of bodies; MuJoCo has w first, Rerun last."""
        return self._data.xpos[bodies], np.roll(self._data.xquat[bodies], -1, axis=1)


def _paths(model: mujoco.MjModel) -> list[str]:
    """Return a path part for each body: its escaped name, made unique among the entities of the world."""
    paths = ["trail", "plan"]
    for body in range(model.nbody):
        name = rr.escape_entity_path_part(body_name(model, body).replace(" ", "_"))
        paths.append(f"{name}_{body}" if name in paths else name)
    return paths[2:]
