"""How the belief about a ball changes with time: mean and covariance through flight and bounces.

The state (11,) is position, velocity, wind, drag, restitution of the surface. At a bounce, which happens when the ball
gets there, the covariance passes through its saltation matrix, Ξ = D + (f⁺ − D f⁻) nᵀ / (nᵀ f⁻), with D the derivative
of the bounce, f⁻ and f⁺ the motion before and after it, n the vertical.
"""

import numpy as np

from robot.striking.flight import STEP_S, Air, Ball, Surface, acceleration, middle_acceleration, time_to_fall

SIZE = 11
POSITION, VELOCITY, WIND = slice(0, 3), slice(3, 6), slice(6, 9)
DRAG, RESTITUTION = 9, 10
TANGENTIAL_SPREAD = 0.02
"""Standard deviation of the horizontal velocity that a bounce keeps, as a part."""


class Transition:
    """Moves beliefs about a ball of this kind over this surface. unmodelled: of the acceleration, m/s per √s."""

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
        """Return what acts on a ball of state `mean`."""
        return Air(float(mean[DRAG]), mean[WIND], self.spin)

    def time_to_bounce(self, mean: np.ndarray, within: float) -> float | None:
        """Return the time (s) to the next bounce if it is at most `within`, a step."""
        a = middle_acceleration(self._ball, self.air(mean), mean[VELOCITY], within)[2]
        found = float(time_to_fall(mean[2] - self._floor, mean[5], a, self._ball.step))
        return found if found <= within and (mean[2] > self._floor or mean[5] < 0) else None

    def fly(self, mean: np.ndarray, covariance: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and covariance after one step of `time` (s) without a bounce."""
        if time <= 0:
            return mean, covariance
        ball, air, v = self._ball, self.air(mean), mean[VELOCITY]
        a = middle_acceleration(ball, air, v, time)
        near = time * (time + ball.step) / 2
        moved = mean.copy()
        moved[POSITION] += v * time + a * near
        moved[VELOCITY] += a * time
        slope, speed = np.zeros((3, 3)), float(np.sqrt(v @ v))
        if air.drag and speed:
            slope -= air.drag * (speed * np.eye(3) + np.outer(v, v) / speed)
        if ball.magnus and self.spin.any():
            x, y, z = ball.magnus * self.spin
            slope += np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        change = np.eye(SIZE)
        change[POSITION, VELOCITY] = time * np.eye(3) + near * slope
        change[VELOCITY, VELOCITY] += time * slope
        change[POSITION, WIND], change[VELOCITY, WIND] = near * np.eye(3), time * np.eye(3)
        change[POSITION, DRAG], change[VELOCITY, DRAG] = -near * speed * v, -time * speed * v
        covariance = change @ covariance @ change.T
        covariance[range(3, 6), range(3, 6)] += self._unmodelled * time
        return moved, covariance

    def bounce(self, mean: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and covariance after a bounce of a ball that meets the surface now: `dwell` later."""
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
        salt = change.copy()
        salt[:, 2] += (after_rate - change @ before_rate) / min(before_rate[2], -1e-3)
        covariance = salt @ covariance @ salt.T
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
        if time < 0:  # Within the contact: the state after it, moved back to now.
            mean = mean.copy()
            mean[POSITION] += mean[VELOCITY] * time
        return mean, covariance, bounces

    def _rate(self, mean: np.ndarray) -> np.ndarray:
        found = np.zeros(SIZE)
        found[POSITION] = mean[VELOCITY]
        found[VELOCITY] = acceleration(self._ball, self.air(mean), mean[VELOCITY])
        return found
