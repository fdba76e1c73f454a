"""Predicted motions of other robots in the scene."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motion.trajectory import Samples


@dataclass(frozen=True, slots=True, eq=False)
class PlannedMotion:
    """A plan of another robot.

    start: s on this robot's clock. dt: s between samples. samples: (count, J), at rest at the end.
    """

    start: float
    dt: float
    samples: Samples

    @property
    def end(self) -> float:
        """Time of the last sample, s."""
        return self.start + (len(self.samples) - 1) * self.dt

    def sample(self, times: np.ndarray) -> np.ndarray:
        """Return positions, velocities and accelerations (3, n, J) at times (n,) from the start on, s."""
        last = len(self.samples) - 1
        place = np.minimum((times - self.start) / self.dt, last)
        row = np.minimum(place.astype(np.intp), max(last - 1, 0))
        part = (place - row)[:, None]
        states = self.samples.positions, self.samples.velocities, self.samples.accelerations
        return np.array([(1 - part) * state[row] + part * state[np.minimum(row + 1, last)] for state in states])


@dataclass(frozen=True, slots=True, eq=False)
class OtherMotion:
    """The motion of another robot along its plans; each plan replaces the earlier ones from its start on.

    positions: (J,), rad, its pose before the first plan. plans: sorted by start. Times are s on this robot's clock.
    """

    positions: np.ndarray
    plans: Sequence[PlannedMotion] = ()

    @property
    def until(self) -> float:
        """Time at which the robot comes to rest, s; -inf if it does not move."""
        return self.plans[-1].end if self.plans else -np.inf

    def sample(self, times: np.ndarray) -> np.ndarray:
        """Return positions, velocities and accelerations (3, n, J) at times (n,), s."""
        states = np.zeros((3, len(times), len(self.positions)))
        states[0] = self.positions
        for plan in self.plans:
            begun = times >= plan.start
            states[:, begun] = plan.sample(times[begun])
        return states
