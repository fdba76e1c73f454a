"""What a tool is asked to do, and why it cannot."""

from dataclasses import dataclass

import mujoco
import numpy as np


@dataclass(frozen=True, slots=True, eq=False)
class ToolTarget:
    """Pose and velocity of the tool site in the world frame.

    position: (3,), m. rotation: (3, 3), or None. axis: (3,), unit vector along which the tool's z points, or None; with
    neither the tool may point anywhere. velocity: (3,), m/s, and angular_velocity: (3,), rad/s; None where free.
    """

    position: np.ndarray
    rotation: np.ndarray | None = None
    axis: np.ndarray | None = None
    velocity: np.ndarray | None = None
    angular_velocity: np.ndarray | None = None

    @property
    def points(self) -> bool:
        """Whether the tool must point somewhere."""
        return self.rotation is not None or self.axis is not None

    @property
    def anywhere(self) -> "ToolTarget":
        """The same position, with the tool pointing anywhere."""
        return ToolTarget(self.position)


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
    """Joint positions (J,) and where they have the tool.

    distance (m) and angle (rad) from its target, position (3,) and quaternion (4,), w first.
    """

    positions: np.ndarray
    distance: float
    angle: float
    position: np.ndarray
    quaternion: np.ndarray


class Unreachable(Exception):
    """No posture was found that meets a target; `str()` says why and what comes nearest.

    reason: out of reach, joint ranges, orientation or velocity. nearest: the posture that comes nearest.
    """

    def __init__(self, reason: str, sentence: str, nearest: Posture) -> None:
        super().__init__(sentence)
        self.reason = reason
        self.nearest = nearest


def rotation_of(quaternion: np.ndarray) -> np.ndarray:
    """Return the rotation matrix (3, 3) of a quaternion (4,) w, x, y, z of any length but 0."""
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion / np.linalg.norm(quaternion))
    return matrix.reshape(3, 3)
