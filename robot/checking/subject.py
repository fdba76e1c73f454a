"""The robot under check, and the findings."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import mujoco

from robot.description import RobotConfig
from robot.dynamics import Load, load_at, sample_poses
from robot.model import body_name, is_slide, joint_ids
from robot.tree import followers

Level = Literal["unusable", "warning", "note"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One sentence about a robot.

    Attributes:
        level: unusable: the arm cannot be driven; warning: it moves, but not as expected; note: information.
        sentence: The fault and its cure.
    """

    level: Level
    sentence: str


@dataclass(frozen=True)
class Subject:
    """A robot and its compiled model; the checks do not change either.

    Attributes:
        config: The robot's description.
        model: The model compiled from it.
    """

    config: RobotConfig
    model: mujoco.MjModel

    @cached_property
    def joints(self) -> list[int]:
        """Indices of the arm's joints, in the order of the vectors."""
        return joint_ids(self.model, self.config.joint_names)

    @cached_property
    def held(self) -> list[int]:
        """Indices of the held joints."""
        return joint_ids(self.model, tuple(self.config.held))

    @cached_property
    def followers(self) -> set[int]:
        """Indices of the joints that an equality couples to others."""
        return followers(self.model)

    @cached_property
    def load_at_home(self) -> Load:
        """Gravity and inertia at home."""
        return load_at(self.model, self.config.pose_at_home, self.joints, self.config.home[None])

    @cached_property
    def load(self) -> Load:
        """Gravity and inertia over the joint ranges."""
        return load_at(self.model, self.config.pose_at_home, self.joints, sample_poses(self.config.limits.positions))

    def is_slide(self, index: int) -> bool:
        """Return whether the arm's joint of this index is a slide, in m and N."""
        return is_slide(self.model, self.joints[index])

    def joint_name(self, joint: int) -> str:
        """Return a joint's name; a joint without a name is called by its body."""
        return self.model.joint(joint).name or f"a joint of {body_name(self.model, int(self.model.jnt_bodyid[joint]))}"
