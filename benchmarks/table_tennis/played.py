"""The played motion to a hit, until the next one replaces it."""

from dataclasses import dataclass

import numpy as np

from motion.trajectory import Trajectory
from robot.striking.choice import State


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A motion played from `start` (s). phase: where in the demonstration it began; hit: time of its end (s)."""

    start: float
    trajectory: Trajectory
    phase: float
    hit: float

    def phase_at(self, time: float) -> float:
        """Return the phase of the demonstration at a time."""
        return self.phase + (1 - self.phase) * min((time - self.start) / (self.hit - self.start), 0.999)

    def state(self, time: float) -> State:
        """Return the arm's reference at a time."""
        samples = self.trajectory.sample(np.array([time - self.start]))
        return State(time, samples.positions[0], samples.velocities[0], samples.accelerations[0])
