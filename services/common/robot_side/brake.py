"""The robot side's own stop, for silence of the controller."""

import math

import numpy as np

from motion.braking import stop
from motion.tracking import tracking_acceleration
from motion.trajectory import Samples
from robot.description import RobotConfig
from services.common.robot_side.backend import Setpoint

RELEASE_DISTANCE = 0.01
"""Largest distance of a command's reference from the held pose, rad on every joint, to release the brake."""

REST_VELOCITY = 1e-9
"""Velocity below which a reference is at rest, rad/s."""


class Brake:
    """Tracks a stop and then its last pose by eq. 11; one call of `setpoint` is one tick.

    Initially it holds `positions` (J,), rad.
    """

    def __init__(self, config: RobotConfig, positions: np.ndarray) -> None:
        self._config = config
        self.hold(positions)

    def hold(self, positions: np.ndarray) -> None:
        """Hold the pose `positions` (J,), rad."""
        rest = np.zeros((1, len(positions)))
        self._follow(Samples(np.array(positions, dtype=float, ndmin=2), rest, rest))

    def engage(self, positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray) -> None:
        """Stop as fast as the acceleration and jerk limits allow, from the measured state and the last command.

        positions, velocities, accelerations: (J,), rad, rad/s, rad/s²; accelerations are clipped to the limits.
        Position limits are not guaranteed, because the start is given.
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
        """Return whether a command may release the brake: both are at rest, close to each other.

        positions, velocities: the command's reference, (J,), rad, rad/s.
        """
        held = self._samples.positions[-1]
        return bool(
            self.at_rest
            and np.all(np.abs(velocities) <= REST_VELOCITY)
            and np.all(np.abs(positions - held) <= RELEASE_DISTANCE)
        )

    def _follow(self, samples: Samples) -> None:
        """Track `samples`, a tick apart, the last at rest.

        An acceleration is held for a tick, so its mean over the tick is right, not its value at the start.
        """
        self._samples = samples
        self._accelerations = np.zeros_like(samples.velocities)
        self._accelerations[:-1] = np.diff(samples.velocities, axis=0) * self._config.rate_hz
        self._index = 0
