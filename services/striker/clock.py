"""The robot's time, and where a motion begins that is asked for now."""

from dataclasses import replace

import numpy as np

from protocol import messages as m
from robot.striking.choice import State

SILENT_S = 1.0
"""A controller that has sent no command for longer is not known to run."""


class Clock:
    """Follows the reference trajectory by the controller's commands. `now`: s, on the robot's clock."""

    def __init__(self, rate_hz: float) -> None:
        self.now = 0.0
        self._rate_hz = rate_hz
        self._run: int | None = None
        self._newest: State | None = None

    def take(self, command: m.Command) -> bool:
        """Take in the newest command; return whether a new run of the robot has begun with it."""
        is_new_run = self._run is not None and command.run != self._run
        if is_new_run:
            self.now = 0.0
        self._run = command.run
        time = command.tick / self._rate_hz
        self.now = max(self.now, time)
        accelerations = command.feedforward if command.feedforward is not None else command.accelerations
        values = command.positions, command.velocities, accelerations
        self._newest = State(time, *(np.array(value) for value in values))
        return is_new_run

    def start(self, lead: float) -> State | None:
        """Return where a motion begins `lead` (s) from now, None while no controller sends commands."""
        newest = self._newest
        if newest is None or self.now - newest.time > SILENT_S:
            return None
        ahead = max(0.0, self.now - newest.time) + lead
        return replace(
            newest,
            time=newest.time + ahead,
            positions=newest.positions + ahead * newest.velocities + ahead**2 / 2 * newest.accelerations,
            velocities=newest.velocities + ahead * newest.accelerations,
        )
