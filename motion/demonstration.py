"""A recorded movement and its smoothing."""

from dataclasses import dataclass
from typing import Literal

import numpy as np


@dataclass(frozen=True, slots=True)
class SavitzkyGolay:
    """A Savitzky-Golay filter: `window_s` in seconds, polynomial `order`."""

    window_s: float
    order: int


Smoothing = Literal["auto", "none"] | SavitzkyGolay


@dataclass(frozen=True, slots=True, eq=False)
class Demonstration:
    """Recorded joint positions (n, J), rad, at strictly increasing times (n,), s."""

    times: np.ndarray
    positions: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class SmoothDemonstration:
    """Positions, velocities, accelerations (n, J) on the uniform grid `times` (n,), which starts at 0."""

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray
    noise_estimate: np.ndarray
    smoothing: SavitzkyGolay | None


def smooth(demonstration: Demonstration, smoothing: Smoothing = "auto") -> SmoothDemonstration:
    """Resample uniformly where needed and differentiate."""
    raise NotImplementedError
