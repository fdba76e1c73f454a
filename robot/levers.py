"""Bounds of the rate at which joint motions reduce the distance of two geoms, valid for all poses.

The distance of two geoms changes at their relative velocity along the line of their nearest points. A hinge between
them contributes at most its speed times the distance of either point from its axis; a slide at most its speed.
"""

import mujoco
import numpy as np

from robot.model import SINGLE_AXIS, rotation_matrix
from robot.tree import joints_of, path_to_world

HINGE, SLIDE = SINGLE_AXIS
PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
UNLIMITED_SLIDE = 10.0
"""Assumed travel of a slide without a range, m: an infinite lever would give no bound."""


class Levers:
    """Bounds of a model's levers, valid for all positions of all joints inside their ranges."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._chains = [[*path_to_world(model, body), 0] for body in range(model.nbody)]
        self._edges = [self._edge(body) for body in range(model.nbody)]

    def between(self, one: int, other: int, joints: list[int]) -> np.ndarray:
        """Return bounds of the decrease of two geoms' distance per unit of each joint (J,): m/rad, or 1 for slides.

        They are 0 for joints that move both geoms or neither.
        """
        model, found = self._model, np.zeros(len(joints))
        bodies = [int(model.geom_bodyid[geom]) for geom in (one, other)]
        moved = [self._chains[body] for body in bodies]
        for index, joint in enumerate(joints):
            body = int(model.jnt_bodyid[joint])
            if (body in moved[0]) == (body in moved[1]):
                continue
            slides = model.jnt_type[joint] == SLIDE
            found[index] = 1.0 if slides else min(self._lever(joint, geom) for geom in (one, other))
        return found

    def _lever(self, joint: int, geom: int) -> float:
        """Return the largest distance of the geom's points from the axis of a hinge, m."""
        model = self._model
        if model.geom_type[geom] == PLANE:
            return float("inf")
        axis, body, target = model.jnt_axis[joint], int(model.jnt_bodyid[joint]), int(model.geom_bodyid[geom])
        anchor, parent = model.jnt_pos[joint], int(model.body_parentid[body])
        alone = model.body_jntnum[body] == 1
        if body not in self._chains[target]:
            # The axis is fixed in the frame of the parent.
            turn = rotation_matrix(model.body_quat[body])
            axis, anchor, body = turn @ axis, model.body_pos[body] + turn @ anchor, parent
        path = self._path(body, target)
        reach = model.geom_rbound[geom]
        first = path[0] if path else None
        if alone and first is None:
            return float(_beside(axis, model.geom_pos[geom] - anchor) + reach)
        reach += np.linalg.norm(model.geom_pos[geom])
        if alone and first is not None and int(model.body_parentid[first]) == body:
            offset = model.body_pos[first]
            swing = self._edges[first] - np.linalg.norm(offset)
            return float(_beside(axis, offset - anchor) + swing + sum(self._edges[b] for b in path[1:]) + reach)
        loose = 0.0 if alone else self._edges[body]
        return float(np.linalg.norm(anchor) + loose + sum(self._edges[b] for b in path) + reach)

    def _path(self, begin: int, end: int) -> list[int]:
        """Return the bodies on the path from one body to another whose edge to their parent is on it, in path order."""
        up, down = self._chains[begin], self._chains[end]
        return [b for b in up if b not in down] + [b for b in reversed(down) if b not in up]

    def _edge(self, body: int) -> float:
        """Return the largest distance of the body's origin from its parent's, m."""
        model, length = self._model, float(np.linalg.norm(self._model.body_pos[body]))
        for joint in joints_of(model, body):
            length += 2 * float(np.linalg.norm(model.jnt_pos[joint]))
            if model.jnt_type[joint] == SLIDE:
                ways = model.jnt_range[joint] - model.qpos0[model.jnt_qposadr[joint]]
                length += float(np.abs(ways).max()) if model.jnt_limited[joint] else UNLIMITED_SLIDE
        return length


def _beside(axis: np.ndarray, vector: np.ndarray) -> float:
    """Return the distance of a point from an axis of unit length through the origin."""
    return float(np.linalg.norm(np.cross(axis, vector)))
