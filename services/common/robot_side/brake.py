"""The arm's own stop, for when commands stop."""

import math

import numpy as np

from motion.braking import stop
from motion.tracking import tracking_acceleration
from motion.trajectory import Samples
from robot.description import RobotConfig
from services.common.robot_side.backend import Setpoint

RELEASE_DISTANCE = 0.01
"""A command takes over from the brake where its reference is this close to the pose held, rad on every joint."""

REST_VELOCITY = 1e-9
"""A reference below this velocity is at rest, rad/s."""


class Brake:
    """Tracks a stop and then its last pose by eq. 11; one call of `setpoint` is one tick.

    It begins by holding `positions` (J,), rad.
    """

    def __init__(self, config: RobotConfig, positions: np.ndarray) -> None:
        self._config = config
        self.hold(positions)

    def hold(self, positions: np.ndarray) -> None:
        """Hold the pose `positions` (J,), rad."""
        rest = np.zeros((1, len(positions)))
        self._follow(Samples(np.array(positions, dtype=float, ndmin=2), rest, rest))

    def engage(self, positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray) -> None:
        """Stop as fast as the acceleration and jerk limits allow, from what is measured and the last command.

        positions, velocities, accelerations: (J,), rad, rad/s, rad/s²; the last are cut to the limits.
        Position limits are not promised: the arm is where it is.
        """
        limits = self._config.limits
        accelerations = np.clip(accelerations, -limits.accelerations, limits.accelerations)
        plan = stop(positions, velocities, accelerations, limits)
        ticks = math.ceil(plan.duration / self._config.tick) + 1
        self._follow(plan.sample(np.arange(ticks + 1) * self._config.tick))

    def setpoint(self, positions: np.ndarray, velocities: np.ndarray) -> Setpoint:
        """Return the setpoint of the coming tick from measured positions and velocities (J,)."""
        now, samples = self._index, self._samples
        reference = (samples.positions[now], samples.velocities[now], self._accelerations[now])
        self._index = then = min(now + 1, len(samples) - 1)
        accelerations = tracking_acceleration(self._config.alpha, reference, positions, velocities)
        return Setpoint(accelerations, samples.positions[then], samples.velocities[then], self._accelerations[now])

    @property
    def at_rest(self) -> bool:
        """Whether the stop has been played to its end."""
        return self._index == len(self._samples) - 1

    def releases(self, positions: np.ndarray, velocities: np.ndarray) -> bool:
        """Whether a command may take over: the brake is at rest, and so is the command's reference, close by.

        positions, velocities: of the command's reference, (J,), rad, rad/s.
        """
        held = self._samples.positions[-1]
        return bool(
            self.at_rest
            and np.all(np.abs(velocities) <= REST_VELOCITY)
            and np.all(np.abs(positions - held) <= RELEASE_DISTANCE)
        )

    def _follow(self, samples: Samples) -> None:
        """Track `samples`, a tick apart, the last at rest.

        An acceleration is held for a tick: what fits is its mean over the tick, not its value at the start.
        """
        self._samples = samples
        self._accelerations = np.zeros_like(samples.velocities)
        self._accelerations[:-1] = np.diff(samples.velocities, axis=0) * self._config.rate_hz
        self._index = 0
