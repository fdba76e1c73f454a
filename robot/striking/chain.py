"""Kinematics of the tool in many postures at once."""

import mujoco
import numpy as np

from robot.description import RobotConfig
from robot.model import joint_ids
from robot.tree import joints_of, path_to_world

SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)


class Chain:
    """Position and z axis of the tool, and their derivatives, for postures (n, J). It reads the model once.

    Before each joint the frame is turned so that the joint's axis is its z axis: what remains is a rotation about z, or
    a translation along it, between constant transforms.
    """

    def __init__(self, config: RobotConfig) -> None:
        model = config.model
        site = model.site(config.tool.site).id
        ids = joint_ids(model, config.joint_names)
        pose = config.pose_at_home
        self._steps: list[tuple[np.ndarray, np.ndarray, int, bool]] = []
        turn, offset = np.eye(3), np.zeros(3)
        for body in reversed(path_to_world(model, int(model.site_bodyid[site]))):
            offset = offset + turn @ model.body_pos[body]
            turn = turn @ _matrix(model.body_quat[body])
            for joint in joints_of(model, body):
                anchor, axis = model.jnt_pos[joint], model.jnt_axis[joint]
                slides = bool(model.jnt_type[joint] == SLIDE)
                onto = _onto(axis)
                place = np.zeros(3) if slides else anchor
                start = model.qpos0[model.jnt_qposadr[joint]]
                if joint in ids:
                    self._steps.append((turn @ onto, offset + turn @ place, ids.index(joint), slides))
                    turn, offset = onto.T, -onto.T @ place
                    if start:  # The model's frames are drawn at this value.
                        back = np.eye(3) if slides else _about_z(-start)
                        offset = back @ offset - [0.0, 0.0, start if slides else 0.0]
                        turn = back @ turn
                else:
                    value = pose[model.jnt_qposadr[joint]] - start
                    rotation = np.eye(3) if slides else onto @ _about_z(value) @ onto.T
                    offset = offset + turn @ (value * axis if slides else place - rotation @ place)
                    turn = turn @ rotation
        self._last = turn @ _matrix(model.site_quat[site]), offset + turn @ model.site_pos[site]

    def pose(self, postures: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the tool's positions and z axes, (n, 3) each, in postures (n, J)."""
        position, _, turns = self._forward(postures)
        return position, turns[:, :, 2]

    def anchors(self, postures: np.ndarray) -> np.ndarray:
        """Return points on the joints' axes in postures (n, J), from the base on, (n, joints, 3)."""
        return np.stack([anchor for _, anchor, _, _ in self._forward(postures)[1]], axis=1)

    def jacobians(self, postures: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return positions, z axes (n, 3), and their derivatives by the joints, (n, 3, J) each."""
        position, joints, turns = self._forward(postures)
        normal = turns[:, :, 2]
        moves, turned = np.zeros((2, *normal.shape, postures.shape[1]))
        for axis, anchor, joint, slides in joints:
            if slides:
                moves[:, :, joint] = axis
                continue
            moves[:, :, joint] = _cross(axis, position - anchor)
            turned[:, :, joint] = _cross(axis, normal)
        return position, normal, moves, turned

    def _forward(
        self, postures: np.ndarray
    ) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray, int, bool]], np.ndarray]:
        count = len(postures)
        turns, position = np.broadcast_to(np.eye(3), (count, 3, 3)), np.zeros((count, 3))
        joints = []
        for turn, offset, joint, slides in self._steps:
            position = position + turns @ offset
            turns = (turns.reshape(-1, 3) @ turn).reshape(count, 3, 3)
            axis = turns[:, :, 2]
            joints.append((axis, position, joint, slides))
            value = postures[:, joint, None]
            if slides:
                position = position + axis * value
                continue
            cos, sin = np.cos(value), np.sin(value)
            x, y = turns[:, :, 0], turns[:, :, 1]
            turns = np.stack([x * cos + y * sin, y * cos - x * sin, axis], axis=2)
        turn, offset = self._last
        return position + turns @ offset, joints, (turns.reshape(-1, 3) @ turn).reshape(count, 3, 3)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a × b of vectors (n, 3); numpy's own takes four times as long."""
    ax, ay, az = a[:, 0], a[:, 1], a[:, 2]
    bx, by, bz = b[:, 0], b[:, 1], b[:, 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    found = np.zeros(9)
    mujoco.mju_quat2Mat(found, quaternion)
    return found.reshape(3, 3)


def _about_z(angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _onto(axis: np.ndarray) -> np.ndarray:
    """Return a rotation whose z axis is `axis` (3,)."""
    z = axis / np.linalg.norm(axis)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)
