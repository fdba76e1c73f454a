"""The robot's time, and the state in which a motion can begin."""

from dataclasses import replace

import numpy as np

from protocol import messages as m
from robot.striking.choice import State

SILENT_S = 1.0
"""The controller counts as absent if it sends no command for this long, s."""


class Clock:
    """Follows the reference trajectory from the controller's commands. `now`: s, on the robot's clock."""

    def __init__(self, rate_hz: float) -> None:
        self.now = 0.0
        self._rate_hz = rate_hz
        self._run: int | None = None
        self._newest: State | None = None

    def update(self, command: m.Command) -> bool:
        """Process the newest command; return whether it begins a new run of the robot."""
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

    def state_after(self, lead: float) -> State | None:
        """Return the state of the reference `lead` (s) from now; None while no controller sends commands."""
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
