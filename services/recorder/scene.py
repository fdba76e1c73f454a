"""The robot's MuJoCo model as Rerun geometry, and its poses."""

from collections.abc import Iterator

import mujoco
import numpy as np
import rerun as rr

from robot.description import RobotConfig
from robot.model import joint_ids
from services.recorder import entities
from services.recorder.writer import TraceWriter

HIDDEN_GROUP = 3
"""Geoms of this group and above stand for collisions, as in MuJoCo's own viewer."""

FLOOR_HALF_SIZE = 1.6
BALL = "ball"
TEE = "tee"


class Scene:
    """The model with its own data. Bodies are those that move with the arm's joints, in model order."""

    def __init__(self, config: RobotConfig) -> None:
        self.model = config.load_model(visual=True)
        self._data = mujoco.MjData(self.model)
        self._joints = joint_ids(self.model, config.joint_names)
        self._qpos = self.model.jnt_qposadr[self._joints]
        self._tool = self.model.site(config.tool.site).id
        self.body_names = [self.model.body(body).name for body in range(self.model.nbody)]
        roots = set(self.model.body_rootid[self.model.jnt_bodyid[self._joints]].tolist())
        self.arm = [b for b in range(1, self.model.nbody) if self.model.body_rootid[b] in roots]

    def radius_of(self, body: str) -> float:
        """Return the radius (m) of a body's first geom, 0 without one."""
        if body not in self.body_names:
            return 0.0
        geom = self.model.body_geomadr[self.body_names.index(body)]
        return float(self.model.geom_size[geom, 0]) if geom >= 0 else 0.0

    def body_poses(self, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the poses of the arm's B bodies at joint positions (N, J), rad.

        Their positions (N, B, 3), m, their quaternions (N, B, 4), x first, and the tool's positions (N, 3), m.
        """
        places = np.empty((len(positions), len(self.arm), 3))
        turns = np.empty((len(positions), len(self.arm), 4))
        tools = np.empty((len(positions), 3))
        for index, pose in enumerate(positions):
            self._place(pose)
            places[index] = self._data.xpos[self.arm]
            turns[index] = self._data.xquat[self.arm]
            tools[index] = self._data.site_xpos[self._tool]
        return places, np.roll(turns, -1, axis=2), tools  # MuJoCo has w first, Rerun last

    def tool_path(self, positions: np.ndarray) -> np.ndarray:
        """Return the tool's positions (N, 3), m, at joint positions (N, J), rad."""
        return self.body_poses(positions)[2]

    def push_arrow(self, joint: int, positions: np.ndarray) -> tuple[str, np.ndarray, np.ndarray]:
        """Return how a positive push on a joint moves the tool: its body, a point and a unit direction in its frame.

        Where the tool lies on the joint's axis the direction is the axis itself.
        """
        self._place(positions)
        model, data = self.model, self._data
        body = int(model.jnt_bodyid[self._joints[joint]])
        axis, tool = data.xaxis[self._joints[joint]], data.site_xpos[self._tool]
        direction = np.cross(axis, tool - data.xanchor[self._joints[joint]])
        reach = np.linalg.norm(direction)
        direction = direction / reach if reach > 0.02 else axis
        to_body = data.xmat[body].reshape(3, 3).T
        return self.body_names[body], to_body @ (tool - data.xpos[body]), to_body @ direction

    def write_geometry(self, trace: TraceWriter) -> None:
        """Write the geometry of everything but ball and tee, which are written once a ball is published."""
        trace.static(entities.WORLD.path, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        mujoco.mj_kinematics(self.model, self._data)
        for body, name in enumerate(self.body_names):
            if name not in (BALL, TEE):
                self.write_body(trace, name)
                if body and body not in self.arm:
                    turn = rr.Quaternion(xyzw=np.roll(self._data.xquat[body], -1))
                    pose = rr.Transform3D(translation=self._data.xpos[body], quaternion=turn)
                    trace.static(entities.FIXED_BODY.at(name), pose)

    def write_body(self, trace: TraceWriter, name: str) -> None:
        """Write the geometry of one body, nothing where there is no such body."""
        if name in self.body_names:
            body = self.body_names.index(name)
            for part, shape in self.shapes(body):
                path = entities.SHAPE.at(name, part) if body else entities.WORLD_SHAPE.at(part)
                trace.static(path, *shape)

    def shapes(self, body: int) -> Iterator[tuple[str, list[rr.AsComponents]]]:
        """Yield the visible geometry of a body: a named part for each kind of shape, and one for each mesh."""
        model = self.model
        start = model.body_geomadr[body]
        geoms = [g for g in range(start, start + model.body_geomnum[body]) if self._is_visible(g)]
        for kind, make in _PRIMITIVES.items():
            chosen = [g for g in geoms if model.geom_type[g] == int(kind)]
            if chosen:
                part = kind.name.removeprefix("mjGEOM_").lower()
                yield part, [make(model, chosen, [_colour(model, g) for g in chosen])]
        for geom in geoms:
            if model.geom_type[geom] == int(mujoco.mjtGeom.mjGEOM_MESH):
                yield f"mesh_{geom}", _mesh(model, geom)

    def _is_visible(self, geom: int) -> bool:
        return self.model.geom_group[geom] < HIDDEN_GROUP and _colour(self.model, geom)[3] > 0

    def _place(self, positions: np.ndarray) -> None:
        self._data.qpos[self._qpos] = positions
        mujoco.mj_kinematics(self.model, self._data)


def _colour(model: mujoco.MjModel, geom: int) -> tuple[int, int, int, int]:
    material = model.geom_matid[geom]
    rgba = model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
    texture = model.mat_texid[material].max() if material >= 0 else -1
    if texture >= 0 and model.tex_height[texture] > 0:
        first = model.tex_adr[texture]
        rgba = np.append(model.tex_data[first : first + 3] / 255.0, rgba[3])  # one of the checker's two
    red, green, blue, alpha = (round(255 * float(value)) for value in rgba)
    return red, green, blue, alpha


def _turns(model: mujoco.MjModel, geoms: list[int]) -> list[rr.Quaternion]:
    return [rr.Quaternion(xyzw=np.roll(model.geom_quat[g], -1)) for g in geoms]


def _boxes(model: mujoco.MjModel, geoms: list[int], colours: list[tuple[int, ...]]) -> rr.AsComponents:
    turns = _turns(model, geoms)
    sizes, places = model.geom_size[geoms], model.geom_pos[geoms]
    return rr.Boxes3D(half_sizes=sizes, centers=places, quaternions=turns, colors=colours, fill_mode="solid")


def _planes(model: mujoco.MjModel, geoms: list[int], colours: list[tuple[int, ...]]) -> rr.AsComponents:
    """Return a thin slab around the arm, whatever the size of the plane, which may be infinite."""
    half_sizes = [[FLOOR_HALF_SIZE, FLOOR_HALF_SIZE, 0.002]] * len(geoms)
    places = model.geom_pos[geoms] - [0.0, 0.0, 0.003]
    return rr.Boxes3D(half_sizes=half_sizes, centers=places, colors=colours, fill_mode="solid")


def _ellipsoids(model: mujoco.MjModel, geoms: list[int], colours: list[tuple[int, ...]]) -> rr.AsComponents:
    half_sizes = [
        [model.geom_size[g, 0]] * 3
        if model.geom_type[g] == int(mujoco.mjtGeom.mjGEOM_SPHERE)
        else model.geom_size[g].tolist()
        for g in geoms
    ]
    return rr.Ellipsoids3D(
        half_sizes=half_sizes,
        centers=model.geom_pos[geoms],
        quaternions=_turns(model, geoms),
        colors=colours,
        fill_mode="solid",
    )


def _cylinders(model: mujoco.MjModel, geoms: list[int], colours: list[tuple[int, ...]]) -> rr.AsComponents:
    return rr.Cylinders3D(
        lengths=2 * model.geom_size[geoms, 1],
        radii=model.geom_size[geoms, 0],
        centers=model.geom_pos[geoms],
        quaternions=_turns(model, geoms),
        colors=colours,
        fill_mode="solid",
    )


def _capsules(model: mujoco.MjModel, geoms: list[int], colours: list[tuple[int, ...]]) -> rr.AsComponents:
    """Rerun places a capsule by its lower end, MuJoCo by its middle."""
    ends = []
    for geom in geoms:
        end = np.empty(3)
        mujoco.mju_rotVecQuat(end, np.array([0.0, 0.0, -model.geom_size[geom, 1]]), model.geom_quat[geom])
        ends.append(model.geom_pos[geom] + end)
    return rr.Capsules3D(
        lengths=2 * model.geom_size[geoms, 1],
        radii=model.geom_size[geoms, 0],
        translations=ends,
        quaternions=_turns(model, geoms),
        colors=colours,
        fill_mode="solid",
    )


def _mesh(model: mujoco.MjModel, geom: int) -> list[rr.AsComponents]:
    mesh = model.geom_dataid[geom]
    points = slice(model.mesh_vertadr[mesh], model.mesh_vertadr[mesh] + model.mesh_vertnum[mesh])
    faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
    shape = rr.Mesh3D(
        vertex_positions=model.mesh_vert[points],
        triangle_indices=model.mesh_face[faces],
        albedo_factor=_colour(model, geom),
    )
    pose = rr.Transform3D(translation=model.geom_pos[geom], quaternion=_turns(model, [geom])[0])
    return [shape, pose]


_PRIMITIVES = {
    mujoco.mjtGeom.mjGEOM_PLANE: _planes,
    mujoco.mjtGeom.mjGEOM_BOX: _boxes,
    mujoco.mjtGeom.mjGEOM_SPHERE: _ellipsoids,
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: _ellipsoids,
    mujoco.mjtGeom.mjGEOM_CYLINDER: _cylinders,
    mujoco.mjtGeom.mjGEOM_CAPSULE: _capsules,
}
