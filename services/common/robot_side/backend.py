"""The interface of a robot, simulated or real, for the loop of the robot side."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from protocol.codec import bad_message
from protocol.messages import Condition, DriveMode, TorqueSource


class RobotFailed(Exception):
    """The robot has failed, and its process must end; `str()` gives the reason and the cure."""


@dataclass(frozen=True, slots=True)
class Abilities:
    """Abilities of a robot, for its description.

    modes: its control modes. delay_ticks: a command that answers tick k is applied at k + delay_ticks. torques_are:
    whether the torques in its states are commanded or measured. own_clock: `step` waits for the robot's next tick;
    otherwise it returns at once, and the loop keeps the time.
    """

    modes: tuple[DriveMode, ...] = ("torque",)
    delay_ticks: int = 0
    torques_are: TorqueSource = "commanded"
    own_clock: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Setpoint:
    """Setpoint for the coming tick; arrays (J,), rad, rad/s, rad/s².

    accelerations: to apply, with feedback (eq. 11). positions, velocities: the reference at the end of the tick.
    feedforward: the reference's mean acceleration over the tick, without feedback.
    """

    accelerations: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    feedforward: np.ndarray

    def continued(self, tick: float) -> "Setpoint":
        """Return the extrapolated setpoint of the next tick, `tick` s long."""
        positions = self.positions + self.velocities * tick + self.feedforward * (tick * tick / 2)
        velocities = self.velocities + self.feedforward * tick
        return Setpoint(self.accelerations, positions, velocities, self.feedforward)


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """The robot at a tick; arrays (J,), rad, rad/s, N·m.

    positions, velocities: measured. torques: of the last tick, commanded or measured (`Abilities.torques_are`);
    saturated: whether each was clipped. true_positions, true_velocities: without noise, None if unknown. condition:
    "ready" if the robot follows setpoints, else the condition that prevents it, with a reason in a sentence. held:
    positions of held joints, for example of a gripper, rad or m by name.
    """

    tick: int
    time: float
    positions: np.ndarray
    velocities: np.ndarray
    torques: np.ndarray
    saturated: np.ndarray
    true_positions: np.ndarray | None = None
    true_velocities: np.ndarray | None = None
    condition: Condition = "ready"
    reason: str = ""
    held: Mapping[str, float] = field(default_factory=dict)


class Backend(ABC):
    """A robot, used by one thread. The loop calls `step` and `observe` at every tick."""

    abilities = Abilities()

    @abstractmethod
    def observe(self) -> Observation:
        """Return the robot at the present tick; the same object until the next `step`."""

    @abstractmethod
    def step(self, setpoint: Setpoint) -> None:
        """Follow `setpoint` for a tick, or ignore it while the condition is not "ready"; increase the tick by 1.

        A robot with its own clock waits for its next tick here, and also counts lost ticks.

        Raises:
            RobotFailed: the robot has failed.
        """

    @abstractmethod
    def begin_run(self) -> None:
        """Start counting ticks from 0, at rest at the present pose."""

    def guide(self) -> None:  # noqa: B027, most robots have no mode "teach"
        """Let the robot be guided by hand until `recover`; `observe` reports when it is."""

    def recover(self) -> None:  # noqa: B027, most robots have nothing to recover from
        """Start to make the robot ready again, without waiting; `observe` reports when it is."""

    def hold(self, targets: Mapping[str, float]) -> float | None:
        """Start to move held joints, for example of a gripper, to new values, rad or m by name, without waiting.

        Returns the duration of that motion, s, or None if it is unknown.

        Raises:
            Refusal: `bad_message` for a joint that is not held, `limit` for a value outside its range.
        """
        raise bad_message("joints", "this robot has no joints that are held")

    def close(self) -> None:  # noqa: B027, most robots have nothing to release
        """Release the robot, at rest or not."""
