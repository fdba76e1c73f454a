"""Dynamics of an arm guided by hand: weightless, damped, and slower near the ends of the joint ranges."""

import numpy as np

from robot.description import RobotConfig

DAMPING = 2.0
"""Damping, 1/s: a released arm stops within about half a second."""

STRONGEST = 20.0
"""Largest acceleration that a hand adds to a joint, rad/s², so that it cannot press the arm into obstacles."""

BRAKE, BRAKE_SHARE = 10.0, 0.25
"""Deceleration before an end of the range: the smaller of this (rad/s²) and this fraction of the joint's limit."""

MARGIN, RETURN = 0.05, 100.0
"""Distance from an end of the range at which a joint stops, rad, and rate at which it returns from beyond, 1/s."""

FAST_SHARE = 0.25
"""Largest speed of a guided joint, as a fraction of its velocity limit."""


class Guidance:
    """Accelerations (J,), rad/s², of a compliant arm under pushes.

    Each joint is limited to speeds from which it can stop inside its range. A push beyond that has no effect, as if the
    motors held against the hand.
    """

    def __init__(self, config: RobotConfig, positions: np.ndarray) -> None:
        """Start at rest at `positions` (J,), rad; a joint that is nearer to an end of its range stays there."""
        limits = config.limits
        low, high = limits.positions.T
        self._low, self._high = np.minimum(low + MARGIN, positions), np.maximum(high - MARGIN, positions)
        self._fast = FAST_SHARE * limits.velocities
        self._strongest = np.minimum(STRONGEST, limits.accelerations)
        self._brake = np.minimum(BRAKE, BRAKE_SHARE * limits.accelerations)
        self._tick = config.tick

    def accelerations(self, positions: np.ndarray, velocities: np.ndarray, pushes: np.ndarray) -> np.ndarray:
        """Return the accelerations at positions, rad, and velocities, rad/s, under pushes, rad/s², (J,) each."""
        upward, downward = (
            np.where(room > 0, np.minimum(self._fast, np.sqrt(2 * self._brake * abs(room))), RETURN * room)
            for room in (self._high - positions, positions - self._low)
        )
        yielding = np.clip(pushes, -self._strongest, self._strongest) - DAMPING * velocities
        return (np.clip(velocities + self._tick * yielding, -downward, upward) - velocities) / self._tick
