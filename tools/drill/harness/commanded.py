"""The motion that a run's commands describe: its smoothness, its use of the limits, its equality with a plan."""

import numpy as np

from protocol import messages as m
from robot.conversions import samples_of
from robot.description import RobotConfig


def differing_commands(commands: list[m.Command], plan: m.Plan, config: RobotConfig, lost: int = 0) -> int:
    """Count the commands during a plan that are not bit-identical to its samples, and those missing beyond `lost`."""
    samples, first = samples_of(plan), round(plan.start_time * config.rate_hz)
    during = [command for command in commands if first <= command.tick < first + plan.count]
    missing = max(0, plan.count - lost - len(during))
    return missing + sum(
        command.positions != samples.positions[command.tick - first].tolist()
        or command.velocities != samples.velocities[command.tick - first].tolist()
        for command in during
    )


class CommandedMotion:
    """The reference trajectory in a run's commands, one sample a tick.

    Attributes:
        positions: (N, J), rad.
        velocities: (N, J), rad/s.
        accelerations: (N − 1, J), mean over each tick, rad/s².
    """

    def __init__(self, commands: list[m.Command], config: RobotConfig) -> None:
        self._config = config
        self.positions = np.array([command.positions for command in commands])
        self.velocities = np.array([command.velocities for command in commands])
        self.accelerations = np.diff(self.velocities, axis=0) * config.rate_hz

    def jerk_used(self) -> float:
        """Return the largest change of acceleration in a tick, as a fraction of the jerk limit."""
        steps = np.abs(np.diff(self.accelerations, axis=0))
        return float((steps / (self._config.limits.jerks * self._config.tick)).max())

    def integration_error(self) -> float:
        """Return the largest error of a step of position against the velocities, integrated by the trapezoidal rule.

        It is a fraction of J·dt³/6, where J is the jerk limit; at constant jerk J it is 1/2.
        """
        means = (self.velocities[1:] + self.velocities[:-1]) / 2
        errors = np.abs(np.diff(self.positions, axis=0) - means * self._config.tick)
        return float((errors / (self._config.limits.jerks * self._config.tick**3 / 6)).max())

    def limits_used(self) -> float:
        """Return the largest position, velocity or acceleration, as a fraction of its limit."""
        limits = self._config.limits
        middle, half = limits.positions.mean(axis=1), np.diff(limits.positions, axis=1)[:, 0] / 2
        return float(
            max(
                (np.abs(self.positions - middle) / half).max(),
                (np.abs(self.velocities) / limits.velocities).max(),
                (np.abs(self.accelerations) / limits.accelerations).max(),
            )
        )
