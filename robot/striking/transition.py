"""Propagate mean and covariance of a ball through flight and bounces.

The state (11,) is position, velocity, wind, drag, restitution of the surface. The time of a bounce depends on the
state, so its covariance passes through the saltation matrix Ξ = D + (f⁺ − D f⁻) nᵀ / (nᵀ f⁻), with D the derivative of
the bounce, f⁻ and f⁺ the time derivative of the state before and after it, n the vertical.
"""

import numpy as np

from robot.striking.flight import Air, Ball, Surface, acceleration, fly, time_to_fall

STEP_S = 0.1
"""Longest step of the propagation, s."""
SIZE = 11
POSITION, VELOCITY, WIND = slice(0, 3), slice(3, 6), slice(6, 9)
DRAG, RESTITUTION = 9, 10
DIAGONAL = np.arange(3), np.arange(3)
POSITION_BY_VELOCITY, POSITION_BY_WIND, VELOCITY_BY_WIND, VELOCITY_BY_VELOCITY = (
    (np.arange(row, row + 3), np.arange(column, column + 3)) for row, column in ((0, 3), (0, 6), (3, 6), (3, 3))
)
"""Index of the diagonal of a block of the transition matrix."""
MAX_DOWNWARD = 100.0
"""Upper bound of a ball's downward acceleration, m/s²."""
TANGENTIAL_SPREAD = 0.02
"""Standard deviation of the horizontal velocity after a bounce, as a part of that velocity."""


class Transition:
    """Propagates the state of a ball over a surface. unmodelled: process noise of the acceleration, m/s per √s."""

    def __init__(self, ball: Ball, surface: Surface, unmodelled: float = 0.02) -> None:
        self._ball = ball
        self._surface = surface
        self._floor = surface.height + ball.radius
        self._unmodelled = unmodelled**2
        self.spin = np.zeros(3)

    @property
    def dwell(self) -> float:
        """Duration of a bounce, s."""
        return self._surface.dwell

    def air(self, mean: np.ndarray) -> Air:
        """Return the forces on a ball of state `mean`."""
        return Air(float(mean[DRAG]), mean[WIND], self.spin)

    def time_to_bounce(self, mean: np.ndarray, within: float) -> float | None:
        """Return the time (s) to the next bounce, None if it is later than `within`, one step."""
        height, speed = float(mean[2]) - self._floor, float(mean[5])
        # Quick exit: even with the largest downward acceleration the ball stays above the surface.
        if height > 0 and height + within * (speed - MAX_DOWNWARD * within / 2) > 0:
            return None
        air, found = self.air(mean), within
        for _ in range(2):
            middle = mean[VELOCITY] + acceleration(self._ball, air, mean[VELOCITY]) * (found / 2)
            a = float(acceleration(self._ball, air, middle)[2])
            found = float(time_to_fall(height, speed, a, self._ball.step))
            if not (found <= within and (height > 0 or speed < 0)):
                return None
        return found

    def fly(self, mean: np.ndarray, covariance: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and covariance after one step of `time` (s) without a bounce."""
        if time <= 0:
            return mean, covariance
        ball, air, moved = self._ball, self.air(mean), mean.copy()
        moved[POSITION], moved[VELOCITY] = fly(ball, air, mean[POSITION], mean[VELOCITY], time)
        near = time * (time + ball.step) / 2
        change = np.eye(SIZE)
        change[POSITION_BY_VELOCITY] = time
        change[POSITION_BY_WIND], change[VELOCITY_BY_WIND] = near, time
        v = (mean[VELOCITY] + moved[VELOCITY]) / 2
        speed = float(np.sqrt(v @ v))
        if air.drag and speed:
            slope = (air.drag / speed) * v[:, None] * v
            slope[DIAGONAL] += air.drag * speed
            change[POSITION, VELOCITY] -= near * slope
            change[VELOCITY, VELOCITY] -= time * slope
        if ball.magnus and self.spin.any():
            x, y, z = ball.magnus * self.spin
            slope = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            change[POSITION, VELOCITY] += near * slope
            change[VELOCITY, VELOCITY] += time * slope
        change[POSITION, DRAG], change[VELOCITY, DRAG] = -near * speed * v, -time * speed * v
        covariance = change @ covariance @ change.T
        covariance[VELOCITY_BY_VELOCITY] += self._unmodelled * time
        return moved, covariance

    def bounce(self, mean: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and covariance after a bounce that begins now: `dwell` later."""
        surface, v, e = self._surface, mean[VELOCITY], float(mean[RESTITUTION])
        kept = np.array([surface.tangential, surface.tangential, -e])
        after = mean.copy()
        after[VELOCITY] = kept * v
        after[:2] += surface.dwell * (v[:2] + after[3:5]) / 2
        after[2] = self._floor
        change = np.eye(SIZE)
        change[VELOCITY, VELOCITY] = np.diag(kept)
        change[5, RESTITUTION] = -v[2]
        change[0, 3] = change[1, 4] = surface.dwell * (1 + surface.tangential) / 2
        before_rate, after_rate = self._rate(mean), self._rate(after)
        saltation = change.copy()
        saltation[:, 2] += (after_rate - change @ before_rate) / min(before_rate[2], -1e-3)
        covariance = saltation @ covariance @ saltation.T
        covariance[3, 3] += (TANGENTIAL_SPREAD * v[0]) ** 2
        covariance[4, 4] += (TANGENTIAL_SPREAD * v[1]) ** 2
        covariance[5, 5] += (surface.spread * v[2]) ** 2
        return after, covariance

    def advance(self, mean: np.ndarray, covariance: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray, int]:
        """Return mean and covariance after `time` (s), and the number of bounces."""
        bounces = 0
        while time > 1e-9:
            step = min(time, STEP_S)
            fall = self.time_to_bounce(mean, step)
            mean, covariance = self.fly(mean, covariance, step if fall is None else fall)
            time -= step if fall is None else fall
            if fall is not None:
                mean, covariance = self.bounce(mean, covariance)
                time -= self._surface.dwell
                bounces += 1
        if time < 0:  # within the contact: extrapolate back from the state after it
            mean = mean.copy()
            mean[POSITION] += mean[VELOCITY] * time
        return mean, covariance, bounces

    def _rate(self, mean: np.ndarray) -> np.ndarray:
        found = np.zeros(SIZE)
        found[POSITION] = mean[VELOCITY]
        found[VELOCITY] = acceleration(self._ball, self.air(mean), mean[VELOCITY])
        return found
