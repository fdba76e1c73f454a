"""The visible geometry of a MuJoCo model as Rerun's shapes."""

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
import rerun as rr

HIDDEN_GROUP = 3
"""First group of collision geoms, as in MuJoCo's viewer; they are not shown."""
PLANE_THICKNESS = 0.002

Colour = tuple[int, int, int, int]
Shape = tuple[rr.AsComponents, ...]


class Geometry:
    """Shapes of a model that was compiled with visual geometry.

    Infinite planes are drawn around `centre` (3,), `half_size` to each side, m.
    """

    def __init__(self, model: mujoco.MjModel, centre: np.ndarray, half_size: float) -> None:
        self._model = model
        self._centre = centre
        self._half_size = half_size
        self._primitives = {
            mujoco.mjtGeom.mjGEOM_PLANE: self._planes,
            mujoco.mjtGeom.mjGEOM_BOX: self._boxes,
            mujoco.mjtGeom.mjGEOM_SPHERE: self._ellipsoids,
            mujoco.mjtGeom.mjGEOM_ELLIPSOID: self._ellipsoids,
            mujoco.mjtGeom.mjGEOM_CYLINDER: self._cylinders,
            mujoco.mjtGeom.mjGEOM_CAPSULE: self._capsules,
        }

    def shapes(self, body: int) -> Iterator[tuple[str, Shape]]:
        """Yield the visible geometry of a body: a named part for each kind of shape, and one for each mesh."""
        model = self._model
        start = model.body_geomadr[body]
        geoms = [g for g in range(start, start + model.body_geomnum[body]) if self._is_visible(g)]
        for kind, make in self._primitives.items():
            chosen = [g for g in geoms if model.geom_type[g] == int(kind)]
            if chosen:
                yield kind.name.removeprefix("mjGEOM_").lower(), (make(chosen),)
        for geom in geoms:
            if model.geom_type[geom] == int(mujoco.mjtGeom.mjGEOM_MESH):
                yield f"mesh_{geom}", self._mesh(geom)

    def _is_visible(self, geom: int) -> bool:
        return self._model.geom_group[geom] < HIDDEN_GROUP and self._colour(geom)[3] > 0

    def _colour(self, geom: int) -> Colour:
        model, material = self._model, self._model.geom_matid[geom]
        rgba = model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
        texture = model.mat_texid[material].max() if material >= 0 else -1
        if texture >= 0 and model.tex_height[texture] > 0:
            first = model.tex_adr[texture]
            rgba = np.append(model.tex_data[first : first + 3] / 255.0, rgba[3])  # a checkerboard has two colours
        red, green, blue, alpha = (round(255 * float(value)) for value in rgba)
        return red, green, blue, alpha

    def _placed(self, geoms: list[int]) -> dict[str, Any]:
        """Return the fields that all primitive shapes share."""
        return {
            "quaternions": [self._turn(g) for g in geoms],
            "colors": [self._colour(g) for g in geoms],
            "fill_mode": "solid",
        }

    def _turn(self, geom: int) -> rr.Quaternion:
        return rr.Quaternion(xyzw=np.roll(self._model.geom_quat[geom], -1))

    def _rotation(self, geom: int) -> np.ndarray:
        matrix = np.empty(9)
        mujoco.mju_quat2Mat(matrix, self._model.geom_quat[geom])
        return matrix.reshape(3, 3)

    def _boxes(self, geoms: list[int]) -> rr.AsComponents:
        sizes, centres = self._model.geom_size[geoms], self._model.geom_pos[geoms]
        return rr.Boxes3D(half_sizes=sizes, centers=centres, **self._placed(geoms))

    def _planes(self, geoms: list[int]) -> rr.AsComponents:
        """Return thin slabs below the planes, clipped to the picture."""
        centres, half_sizes = [], []
        for geom in geoms:
            rotation, origin = self._rotation(geom), self._model.geom_pos[geom]
            fixed = self._model.geom_bodyid[geom] == 0
            middle = rotation[:, :2].T @ (self._centre - origin) if fixed else np.zeros(2)
            size = np.where(self._model.geom_size[geom, :2] > 0, self._model.geom_size[geom, :2], np.inf)
            low, high = np.maximum(-size, middle - self._half_size), np.minimum(size, middle + self._half_size)
            low = np.minimum(low, high)  # empty for a plane outside the picture
            centres.append(origin + rotation @ [*(low + high) / 2, -1.5 * PLANE_THICKNESS])
            half_sizes.append([*(high - low) / 2, PLANE_THICKNESS])
        return rr.Boxes3D(half_sizes=half_sizes, centers=centres, **self._placed(geoms))

    def _ellipsoids(self, geoms: list[int]) -> rr.AsComponents:
        model, sphere = self._model, int(mujoco.mjtGeom.mjGEOM_SPHERE)
        half_sizes = [
            [model.geom_size[g, 0]] * 3 if model.geom_type[g] == sphere else model.geom_size[g].tolist() for g in geoms
        ]
        return rr.Ellipsoids3D(half_sizes=half_sizes, centers=model.geom_pos[geoms], **self._placed(geoms))

    def _cylinders(self, geoms: list[int]) -> rr.AsComponents:
        radii, half_lengths = self._model.geom_size[geoms, :2].T
        centres = self._model.geom_pos[geoms]
        return rr.Cylinders3D(lengths=2 * half_lengths, radii=radii, centers=centres, **self._placed(geoms))

    def _capsules(self, geoms: list[int]) -> rr.AsComponents:
        """Rerun places a capsule by its lower end, MuJoCo by its middle."""
        radii, half_lengths = self._model.geom_size[geoms, :2].T
        ends = [
            self._model.geom_pos[g] - half_length * self._rotation(g)[:, 2]
            for g, half_length in zip(geoms, half_lengths, strict=True)
        ]
        return rr.Capsules3D(lengths=2 * half_lengths, radii=radii, translations=ends, **self._placed(geoms))

    def _mesh(self, geom: int) -> Shape:
        model, mesh = self._model, self._model.geom_dataid[geom]
        vertices, normals, faces = _with_normals(model, mesh)
        shape = rr.Mesh3D(
            vertex_positions=vertices,
            vertex_normals=normals,
            triangle_indices=faces,
            albedo_factor=self._colour(geom),
        )
        return shape, rr.Transform3D(translation=model.geom_pos[geom], quaternion=self._turn(geom))


def _with_normals(model: mujoco.MjModel, mesh: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices (V, 3), their normals (V, 3) and faces (F, 3) of a mesh.

    MuJoCo indexes the normals of a face's corners separately. Each pair of vertex and normal becomes a vertex.
    """
    start, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    corners = model.mesh_face[start : start + count].astype(np.int64)
    turns = model.mesh_facenormal[start : start + count]
    pairs, faces = np.unique(corners * model.mesh_normalnum[mesh] + turns, return_inverse=True)
    vertices = model.mesh_vert[model.mesh_vertadr[mesh] + pairs // model.mesh_normalnum[mesh]]
    normals = model.mesh_normal[model.mesh_normaladr[mesh] + pairs % model.mesh_normalnum[mesh]]
    return vertices, normals, faces.reshape(-1, 3).astype(np.uint32)
