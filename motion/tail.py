"""The jerk-limited stop after a hit or a cancel."""

from dataclasses import dataclass

import numpy as np

from motion.limits import Limits
from motion.samples import Samples


@dataclass(frozen=True, slots=True, eq=False)
class Stop:
    """A stop of J joints, each as fast as its own limits allow."""

    duration: float

    def sample(self, times: np.ndarray) -> Samples:
        """States at `times` (n,), s from the start of the stop; exactly at rest from `duration` on."""
        raise NotImplementedError


def stop(positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray, limits: Limits) -> Stop:
    """The fastest stop from a state (J,) inside the acceleration and jerk limits."""
    raise NotImplementedError


def stop_extremes(
    positions: np.ndarray,
    velocities: np.ndarray,
    accelerations: np.ndarray,
    max_accelerations: np.ndarray,
    max_jerks: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Lowest and highest position and velocity (p_min, p_max, v_min, v_max) of the stop from each state."""
    raise NotImplementedError


def first_stop(samples: Samples, limits: Limits) -> int | None:
    """Index of the first sample from which the stop stays inside the position and velocity limits."""
    raise NotImplementedError
