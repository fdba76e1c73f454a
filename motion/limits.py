"""Limits on position, velocity, acceleration and jerk, per joint."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from motion.errors import InvalidMotion, LimitExceeded

QUANTITIES = ("position", "velocity", "acceleration", "jerk")

SIGNS = np.array([-1.0, 1.0])
"""Signs that turn lower bounds into upper bounds: sign·value ≤ limit."""

ROUNDING = 1e-6
"""A requested value may exceed its limit by this part of the limit's range: clients may round to float32."""

RETURN_FROM = 0.02
"""A motion may begin up to this far (rad) outside a position limit, where the arm was pushed, …"""

RETURN_BY = 0.2
"""… and must be inside after this part of its duration."""


@dataclass(frozen=True, slots=True, eq=False)
class Limits:
    """Limits of J joints; ±inf stands for no limit.

    positions: (J, 2), rad, lowest and highest; velocities (rad/s), accelerations (rad/s²) and jerks (rad/s³): (J,),
    symmetric, > 0. `ranges` (J, 4, 2): lowest and highest value of each quantity, in the order of QUANTITIES. `signed`
    (J, 2, 4): the same as upper bounds of sign·value. `width` (J, 4): width of the ranges, 1 without a limit. Raises
    InvalidMotion for wrong shapes, NaN, or an empty range.
    """

    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray
    jerks: np.ndarray
    ranges: np.ndarray = field(init=False, repr=False)
    signed: np.ndarray = field(init=False, repr=False)
    width: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("positions", "velocities", "accelerations", "jerks"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))
        joints = len(self.velocities)
        if self.positions.shape != (joints, 2) or not np.all(self.positions[:, 0] < self.positions[:, 1]):
            raise InvalidMotion("limits.positions", f"needs {joints} pairs, the lower value first")
        for name in ("velocities", "accelerations", "jerks"):
            values = getattr(self, name)
            if values.shape != (joints,) or not np.all(values > 0):
                raise InvalidMotion(f"limits.{name}", f"needs {joints} numbers greater than 0")
        highest = np.stack([self.positions[:, 1], self.velocities, self.accelerations, self.jerks], axis=1)
        ranges = np.stack([-highest, highest], axis=2)
        ranges[:, 0, 0] = self.positions[:, 0]
        width = ranges[:, :, 1] - ranges[:, :, 0]
        derived = {
            "ranges": ranges,
            "signed": SIGNS[:, None] * ranges.transpose(0, 2, 1),
            "width": np.where(np.isfinite(width), width, 1.0),
        }
        for name, values in derived.items():
            values.flags.writeable = False
            object.__setattr__(self, name, values)

    @staticmethod
    def unlimited(joint_count: int) -> "Limits":
        """Limits that bound nothing."""
        free = np.full(joint_count, np.inf)
        return Limits(np.stack([-free, free], axis=1), free, free, free)

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return len(self.velocities)

    @property
    def slack(self) -> np.ndarray:
        """Tolerance (J, 4) by which a value rounded to float32 may exceed a limit."""
        return ROUNDING * self.width

    def clipped(self, quantity: int, values: np.ndarray) -> np.ndarray:
        """Values (J,) of a quantity, with those that exceed a limit by rounding set to the limit; NaN stays."""
        low, high = self.ranges[:, quantity].T
        slack = self.slack[:, quantity]
        values = np.where((values > high) & (values <= high + slack), high, values)
        return np.where((values < low) & (values >= low - slack), low, values)

    def outside(self, quantity: np.ndarray, values: np.ndarray, slack: np.ndarray | float = 0.0) -> np.ndarray:
        """Which values (…, F, J) of the quantities (F,) exceed their limits by more than `slack`; NaN does not."""
        low, high = self.ranges.transpose(2, 1, 0).take(quantity, axis=1)
        return (values < low - slack) | (values > high + slack)

    def exceeded(
        self, quantity: np.ndarray, values: np.ndarray, slack: np.ndarray | float = 0.0, of: Sequence[str] | None = None
    ) -> LimitExceeded | None:
        """Return the error of the first joint's first value (F, J) that violates its limit, None if all are inside.

        Violations up to rounding and `slack` are ignored. `of` (F,) are the names of the values in the error.
        """
        found = np.argwhere(self.outside(quantity, values, np.maximum(self.slack.T[quantity], slack)).T)
        if not len(found):
            return None
        joint, k = found[0].tolist()
        value, (low, high) = float(values[k, joint]), self.ranges[joint, quantity[k]].tolist()
        bound, whose = low if value < low else high, of[int(k)] if of else ""
        return LimitExceeded(joint, QUANTITIES[quantity[k]], value, bound, whose)

    def tightened(self, other: "Limits") -> "Limits":
        """The intersection of both limits. Raises InvalidMotion if the position ranges do not overlap."""
        low = np.maximum(self.positions[:, 0], other.positions[:, 0])
        high = np.minimum(self.positions[:, 1], other.positions[:, 1])
        return Limits(
            np.stack([low, high], axis=1),
            np.minimum(self.velocities, other.velocities),
            np.minimum(self.accelerations, other.accelerations),
            np.minimum(self.jerks, other.jerks),
        )
