"""A simulated model and the arms of this process in it, which share the ball and the tick."""

from collections.abc import Sequence
from typing import Protocol

import mujoco
import numpy as np

from robot.description import RobotConfig
from robot.schema import RobotError
from services.sim.ball import SimulatedBall
from services.sim.model import Scene, build_scene


class Driven(Protocol):
    """An arm of a world: its part of a tick."""

    def is_set(self) -> bool:
        """Return whether the arm has its setpoint for the coming tick."""
        ...

    def place_led(self) -> None:
        """Set the joints that follow other robots' states."""
        ...

    def drive(self) -> None:
        """Turn the setpoint into torques and apply them."""
        ...

    def take_contacts(self, substep: int) -> None:
        """Process the contacts of a physics step, the `substep`-th of the tick."""
        ...

    def finish(self) -> None:
        """Measure, and count the tick."""
        ...


class World:
    """A model and its state, with the ball, for one or several arms.

    Attributes:
        scene: The model, prepared for the first of the arms.
        ball: The ball, None in a model without one.
        joints: Names of the joints of all arms.
    """

    def __init__(self, configs: Sequence[RobotConfig]) -> None:
        """Prepare for the robots in `configs`, which stand in one model; then each robot's arm must `join`.

        Raises:
            RobotError: they cannot be simulated together; the sentence gives the reason.
        """
        first, *rest = configs
        for other in rest:
            _check_together(first, other)
        self.scene: Scene = build_scene(first)
        self.ball = SimulatedBall(first.ball, self.scene) if first.ball else None
        self.joints = frozenset(name for config in configs for name in config.joint_names)
        if len(self.joints) < sum(config.joint_count for config in configs):
            raise RobotError("two robots of one simulation name the same joint; give each the joints of its own arm")
        self._count = len(configs)
        self._arms: list[Driven] = []
        self._qpos, self._dofs = [], []

    def join(self, arm: Driven, qpos: np.ndarray, dofs: np.ndarray) -> None:
        """Add an arm whose joints are at these addresses (J,)."""
        self._arms.append(arm)
        self._qpos.append(qpos)
        self._dofs.append(dofs)
        self._all_qpos, self._all_dofs = np.concatenate(self._qpos), np.concatenate(self._dofs)

    def reset(self, arm: Driven) -> None:
        """Reset everything to the model's initial state, except the other arms, which do not move."""
        data = self.scene.data
        others = [i for i, other in enumerate(self._arms) if other is not arm]
        kept = [(i, data.qpos[self._qpos[i]], data.qvel[self._dofs[i]]) for i in others]
        mujoco.mj_resetData(self.scene.model, data)
        for i, positions, velocities in kept:
            data.qpos[self._qpos[i]], data.qvel[self._dofs[i]] = positions, velocities

    def step(self) -> None:
        """Simulate a tick, when every arm has its setpoint."""
        arms = self._arms
        if len(arms) < self._count or not all(arm.is_set() for arm in arms):
            return
        model, data = self.scene.model, self.scene.data
        for arm in arms:
            arm.place_led()
        mujoco.mj_step1(model, data)
        for arm in arms:
            arm.drive()
        for substep in range(self.scene.substeps):
            if substep:
                mujoco.mj_step1(model, data)
            self._advance()
            for arm in arms:
                arm.take_contacts(substep)
        for arm in arms:
            arm.finish()

    def _advance(self) -> None:
        """Finish a physics step.

        MuJoCo moves positions with the velocities after the step; for a constant acceleration a over the step h they
        are h/2·a·h too far. With the mean of the velocities before and after, the arms' positions are exact.
        """
        model, data = self.scene.model, self.scene.data
        before = data.qvel[self._all_dofs]
        if self.ball is not None:
            self.ball.act()
        mujoco.mj_step2(model, data)
        data.qpos[self._all_qpos] -= model.opt.timestep / 2 * (data.qvel[self._all_dofs] - before)


def _check_together(first: RobotConfig, other: RobotConfig) -> None:
    """Raise RobotError if two robots cannot be simulated together."""
    names = f"{first.name} and {other.name}"
    if first.name == other.name:
        raise RobotError(f"two robots of one simulation are called {first.name!r}; give each a name of its own")
    for what, one, two in (
        ("model", first.mjcf_path.resolve(), other.mjcf_path.resolve()),
        ("rate_hz", first.rate_hz, other.rate_hz),
        ("[ball]", first.ball, other.ball),
    ):
        if one != two:
            raise RobotError(f"{names} have not the same {what}; in one simulation they share it")
