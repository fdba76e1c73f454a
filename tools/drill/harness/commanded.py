"""The motion that a run's commands make: whether it is smooth, inside the limits, and the plan's own."""

import numpy as np

from protocol import messages as m
from robot.conversions import samples_of
from robot.description import RobotConfig


def unlike_plan(commands: list[m.Command], plan: m.Plan, config: RobotConfig, lost: int = 0) -> int:
    """Return how many commands during a plan differ in a bit from its samples, or are missing beyond `lost`."""
    samples, first = samples_of(plan), round(plan.start_time * config.rate_hz)
    during = [command for command in commands if first <= command.tick < first + plan.count]
    missing = max(0, plan.count - lost - len(during))
    return missing + sum(
        command.positions != samples.positions[command.tick - first].tolist()
        or command.velocities != samples.velocities[command.tick - first].tolist()
        for command in during
    )


class CommandedMotion:
    """The reference in a run's commands, tick by tick.

    Attributes:
        positions: (N, J), rad.
        velocities: (N, J), rad/s.
        accelerations: (N − 1, J), the mean of each tick, rad/s².
    """

    def __init__(self, commands: list[m.Command], config: RobotConfig) -> None:
        self._config = config
        self.positions = np.array([command.positions for command in commands])
        self.velocities = np.array([command.velocities for command in commands])
        self.accelerations = np.diff(self.velocities, axis=0) * config.rate_hz

    def jerk_used(self) -> float:
        """Return the largest step of acceleration in a tick as a share of what the jerk limit allows."""
        steps = np.abs(np.diff(self.accelerations, axis=0))
        return float((steps / (self._config.limits.jerks * self._config.tick)).max())

    def gap_used(self) -> float:
        """Return the largest step of position that velocity does not explain, as a share of what the jerk limit allows.

        The trapezoid of the velocities is off by half of J·dt³/6 where the jerk is at its limit J.
        """
        means = (self.velocities[1:] + self.velocities[:-1]) / 2
        gaps = np.abs(np.diff(self.positions, axis=0) - means * self._config.tick)
        return float((gaps / (self._config.limits.jerks * self._config.tick**3 / 6)).max())

    def limits_used(self) -> float:
        """Return the largest position, velocity or acceleration as a share of its limit."""
        limits = self._config.limits
        middle, half = limits.positions.mean(axis=1), np.diff(limits.positions, axis=1)[:, 0] / 2
        return float(
            max(
                (np.abs(self.positions - middle) / half).max(),
                (np.abs(self.velocities) / limits.velocities).max(),
                (np.abs(self.accelerations) / limits.accelerations).max(),
            )
        )
