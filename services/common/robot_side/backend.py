"""The interface of a robot: what the loop of the robot side needs of it, be it simulated or real."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from protocol.codec import bad_message
from protocol.messages import Condition, DriveMode, TorqueSource


class RobotFailed(Exception):
    """The robot cannot go on, and neither can its process; `str()` says why and what would help."""


@dataclass(frozen=True, slots=True)
class Abilities:
    """What a robot can do, as its description says it.

    modes: how it may be led. delay_ticks: a command that answers tick k is applied at k + delay_ticks. torques_are:
    what its states say of torques. own_clock: `step` waits for the robot's next tick; otherwise it returns at once, and
    the loop keeps the time.
    """

    modes: tuple[DriveMode, ...] = ("torque",)
    delay_ticks: int = 0
    torques_are: TorqueSource = "commanded"
    own_clock: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Setpoint:
    """What to do during the coming tick; arrays (J,), rad, rad/s, rad/s².

    accelerations: to apply, with feedback (eq. 11). positions, velocities: of the reference at the end of the tick.
    feedforward: the reference's mean acceleration over the tick, without feedback.
    """

    accelerations: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    feedforward: np.ndarray

    def continued(self, tick: float) -> "Setpoint":
        """Return the setpoint of the tick after this one, `tick` s long, where nothing else is known."""
        positions = self.positions + self.velocities * tick + self.feedforward * (tick * tick / 2)
        velocities = self.velocities + self.feedforward * tick
        return Setpoint(self.accelerations, positions, velocities, self.feedforward)


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """What the robot says at a tick; arrays (J,), rad, rad/s, N·m.

    positions, velocities: measured. torques: of the tick before, as `Abilities.torques_are` says; saturated where they
    were clipped. true_positions, true_velocities: without noise, None where unknown. condition: "ready" where the robot
    follows setpoints, else what keeps it from that, with the reason in a sentence. held: positions of the joints
    that are held beside the arm's, as a gripper's, rad or m by name.
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
    """A robot: one object in one thread. The loop calls `step` and `observe` at every tick."""

    abilities = Abilities()

    @abstractmethod
    def observe(self) -> Observation:
        """Return the robot at the present tick; the same object until the next `step`."""

    @abstractmethod
    def step(self, setpoint: Setpoint) -> None:
        """Follow `setpoint` for a tick, or ignore it while the condition is not "ready"; the tick count rises by 1.

        A robot that is the clock itself waits for its next tick here, and counts those that it lost.

        Raises:
            RobotFailed: there is no going on.
        """

    @abstractmethod
    def begin_run(self) -> None:
        """Begin to count ticks from 0, at rest where the robot stands."""

    def guide(self) -> None:  # noqa: B027, most robots have no mode "teach"
        """Let the robot be guided by hand until `recover`: `observe` says when it is."""

    def recover(self) -> None:  # noqa: B027, most robots have nothing to recover from
        """Begin to make the robot ready again, without waiting: `observe` says when it is."""

    def hold(self, targets: Mapping[str, float]) -> float | None:
        """Begin to lead held joints, as a gripper's, to new values, rad or m by name, without waiting.

        Returns how long that takes, s, or None where it is not known.

        Raises:
            Refusal: `bad_message` for a joint that is not held, `limit` for a value outside its range.
        """
        raise bad_message("joints", "this robot has no joints that are held")

    def close(self) -> None:  # noqa: B027, most robots have nothing to release
        """Release the robot, at rest or not."""
