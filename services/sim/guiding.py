"""An arm that is guided by hand: weightless, damped, and pushed back softly before the ends of its joints."""

import numpy as np

from robot.description import RobotConfig

DAMPING = 2.0
"""1/s: an arm that is let go loses its speed within about half a second."""

MARGIN, STIFFNESS, STOP_DAMPING = 0.2, 900.0, 60.0
"""rad, 1/s², 1/s: a critically damped spring begins so far before the end of a joint's range."""

FAST_SHARE, FAST_DAMPING = 0.25, 100.0
"""Beyond this part of its velocity limit a joint is damped by so much more, 1/s."""


class Guidance:
    """Accelerations (J,), rad/s², of an arm that yields to pushes."""

    def __init__(self, config: RobotConfig) -> None:
        low, high = config.limits.positions.T
        room = np.minimum(MARGIN, (high - low) / 4)
        self._low, self._high = low + room, high - room
        self._fast = FAST_SHARE * config.limits.velocities

    def accelerations(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        """Return what the arm does of itself at positions, rad, and velocities, rad/s, (J,) each."""
        inward = np.maximum(self._low - positions, 0.0) - np.maximum(positions - self._high, 0.0)
        too_fast = velocities - np.clip(velocities, -self._fast, self._fast)
        damping = np.where(inward != 0.0, STOP_DAMPING, DAMPING)
        return STIFFNESS * inward - damping * velocities - FAST_DAMPING * too_fast
