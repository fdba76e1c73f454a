"""Targets of the tool, postures that meet them, and the error if there is none."""

from dataclasses import dataclass

import numpy as np

from robot.model import rotation_matrix


@dataclass(frozen=True, slots=True, eq=False)
class ToolTarget:
    """Pose and velocity of the tool site in the world frame.

    position: (3,), m. rotation: (3, 3), or None. axis: (3,), unit vector of the tool's z axis, or None; without either
    the orientation is free. velocity: (3,), m/s, and angular_velocity: (3,), rad/s; None if free.
    """

    position: np.ndarray
    rotation: np.ndarray | None = None
    axis: np.ndarray | None = None
    velocity: np.ndarray | None = None
    angular_velocity: np.ndarray | None = None

    @property
    def points(self) -> bool:
        """Whether the target fixes the tool's axis or orientation."""
        return self.rotation is not None or self.axis is not None

    @property
    def anywhere(self) -> "ToolTarget":
        """The same target with a free orientation."""
        return ToolTarget(self.position)


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
    """Joint positions (J,) and the tool's pose at them.

    distance (m) and angle (rad): from the target. position (3,), m, and quaternion (4,), w first: of the tool.
    """

    positions: np.ndarray
    distance: float
    angle: float
    position: np.ndarray
    quaternion: np.ndarray


class Unreachable(Exception):
    """No posture was found that meets a target; `str()` gives the reason and the nearest pose.

    reason: out of reach, joint ranges, orientation or velocity. nearest: the posture nearest to the target.
    """

    def __init__(self, reason: str, sentence: str, nearest: Posture) -> None:
        super().__init__(sentence)
        self.reason = reason
        self.nearest = nearest


def rotation_of(quaternion: np.ndarray) -> np.ndarray:
    """Return the rotation matrix (3, 3) of a quaternion (4,) w, x, y, z of any length but 0."""
    return rotation_matrix(quaternion / np.linalg.norm(quaternion))
