"""An arm that is guided by hand: weightless, damped, and slower the nearer a joint is to an end of its range."""

import numpy as np

from robot.description import RobotConfig

DAMPING = 2.0
"""1/s: an arm that is let go loses its speed within about half a second."""

STRONGEST = 20.0
"""rad/s²: what a hand adds to a joint's acceleration at most, so that it presses the arm into nothing."""

BRAKE, BRAKE_SHARE = 10.0, 0.25
"""rad/s² and part of a joint's acceleration limit: the smaller one brakes it before an end of its range."""

MARGIN, RETURN = 0.05, 100.0
"""rad, 1/s: a joint stands still so far before an end of its range, and comes back at this rate if it is moved on."""

FAST_SHARE = 0.25
"""Part of its velocity limit: no joint is guided faster."""


class Guidance:
    """Accelerations (J,), rad/s², of an arm that yields to pushes.

    Each joint keeps to speeds from which it can be braked inside its range. What a push would do beyond has no effect,
    as if the hand were no stronger than the motors.
    """

    def __init__(self, config: RobotConfig, positions: np.ndarray) -> None:
        """Begin at rest at `positions` (J,), rad; a joint that is nearer to an end stays where it is."""
        limits = config.limits
        low, high = limits.positions.T
        self._low, self._high = np.minimum(low + MARGIN, positions), np.maximum(high - MARGIN, positions)
        self._fast = FAST_SHARE * limits.velocities
        self._strongest = np.minimum(STRONGEST, limits.accelerations)
        self._brake = np.minimum(BRAKE, BRAKE_SHARE * limits.accelerations)
        self._tick = config.tick

    def accelerations(self, positions: np.ndarray, velocities: np.ndarray, pushes: np.ndarray) -> np.ndarray:
        """Return what the arm does at positions, rad, and velocities, rad/s, under pushes, rad/s², (J,) each."""
        upward, downward = (
            np.where(room > 0, np.minimum(self._fast, np.sqrt(2 * self._brake * abs(room))), RETURN * room)
            for room in (self._high - positions, positions - self._low)
        )
        yielding = np.clip(pushes, -self._strongest, self._strongest) - DAMPING * velocities
        return (np.clip(velocities + self._tick * yielding, -downward, upward) - velocities) / self._tick
