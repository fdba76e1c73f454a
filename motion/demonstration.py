"""A recorded movement, and the filter that a caller may choose for it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from motion.errors import InvalidMotion

MIN_SAMPLES = 10


@dataclass(frozen=True, slots=True)
class SavitzkyGolay:
    """A Savitzky-Golay filter: `window_s` in seconds, polynomial `order` (2 or more)."""

    window_s: float
    order: int


Smoothing = Literal["auto", "none"] | SavitzkyGolay


@dataclass(frozen=True, slots=True, eq=False)
class Demonstration:
    """Recorded joint positions (n, J), rad, at strictly increasing times (n,), s.

    Raises InvalidMotion for wrong shapes, fewer than MIN_SAMPLES samples, non-finite numbers, or times that
    do not increase.
    """

    times: np.ndarray
    positions: np.ndarray

    def __post_init__(self) -> None:
        times, positions = np.asarray(self.times, dtype=float), np.asarray(self.positions, dtype=float)
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "positions", positions)
        if positions.ndim != 2 or positions.shape[1] == 0:
            raise InvalidMotion("positions", f"needs samples × joints; it has shape {positions.shape}")
        if times.shape != (len(positions),):
            raise InvalidMotion("times", f"needs one time a sample, {len(positions)}; it has shape {times.shape}")
        if len(times) < MIN_SAMPLES:
            raise InvalidMotion("positions", f"has {len(times)} samples; at least {MIN_SAMPLES} are needed")
        if not np.isfinite(positions).all():
            row, joint = np.argwhere(~np.isfinite(positions))[0]
            raise InvalidMotion("positions", f"is not finite at sample {row}, joint {joint}")
        if not np.isfinite(times).all():
            row = int(np.argmin(np.isfinite(times)))
            raise InvalidMotion("times", f"sample {row}'s time is {times[row]}; it must be finite")
        if (steps := np.diff(times)).min() <= 0:
            row = int(np.argmax(steps <= 0)) + 1
            relation = "lies before" if steps[row - 1] < 0 else "is the same as"
            raise InvalidMotion("times", f"sample {row}'s time {float(times[row])} s {relation} sample {row - 1}'s")

    @property
    def duration(self) -> float:
        """Time from the first sample to the last, s."""
        return float(self.times[-1] - self.times[0])

    @property
    def phases(self) -> np.ndarray:
        """Normalised times s (n,) of the samples, from 0 to 1."""
        return np.clip((self.times - self.times[0]) / self.duration, 0.0, 1.0)
