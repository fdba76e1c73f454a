"""A sampled motion."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Positions (rad), velocities (rad/s) and accelerations (rad/s²): (count, J) each."""

    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray

    def __len__(self) -> int:
        return len(self.positions)
