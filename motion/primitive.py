"""A movement primitive: what is kept of a demonstration."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from motion.demonstration import Demonstration, SavitzkyGolay, Smoothing
from motion.request import Boundary


@dataclass(frozen=True, slots=True, eq=False)
class Primitive:
    """A demonstration in normalised time: everything the planner needs to imitate it."""

    duration: float
    theta: np.ndarray
    positions: np.ndarray
    accelerations: np.ndarray
    start: Boundary
    goal: Boundary
    samples: int
    fit_rms: np.ndarray
    noise_estimate: np.ndarray
    smoothing: SavitzkyGolay | None

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return len(self.theta)

    @property
    def basis_count(self) -> int:
        """Number of basis functions N."""
        return self.theta.shape[1]

    def demonstrated_positions(self, s: np.ndarray) -> np.ndarray:
        """The demonstrated positions (n, J), rad, at normalised times s (n,) in [0, 1]."""
        raise NotImplementedError

    def to_arrays(self) -> dict[str, np.ndarray]:
        """All fields as arrays, for `np.savez`."""
        raise NotImplementedError

    @staticmethod
    def from_arrays(arrays: Mapping[str, np.ndarray]) -> "Primitive":
        """The primitive that `to_arrays` wrote. Raises InvalidMotion for anything malformed."""
        raise NotImplementedError


def learn(demonstration: Demonstration, smoothing: Smoothing = "auto", basis_count: int = 50) -> Primitive:
    """Learn a primitive from one demonstration."""
    raise NotImplementedError
