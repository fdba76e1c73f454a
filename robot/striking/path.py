"""The predicted path of a ball: states with their covariance."""

from dataclasses import dataclass

import numpy as np

from robot.striking.flight import Air, Cubic
from robot.striking.transition import POSITION, STEP_S, VELOCITY, Transition

ROLLING_M_S = 0.3
"""m/s; a ball that leaves a bounce more slowly is assumed to roll."""
NEAR_STEP_S = 0.02
"""Time between positions of a ball that are compared with points, s."""


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """Predicted states of a ball at n times: s, in the clock of its sights; there is one before and after each bounce.

    positions, velocities: (n, 3), m, m/s. covariances: (n, 6, 6), of both. bounces: (n,), number since the begin of the
    prediction. air: forces on the ball.
    """

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    covariances: np.ndarray
    bounces: np.ndarray
    air: Air

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and velocities (m, 3) at times (m,) inside the path, by cubic interpolation."""
        k, u, width = self._within(times)
        p, q = self.positions[k], self.positions[k + 1]
        cubic = Cubic(p, q, self.velocities[k] * width, self.velocities[k + 1] * width)
        flies = (self.bounces[k] == self.bounces[k + 1])[:, None]
        positions = np.where(flies, cubic.at(u), p + u[:, None] * (q - p))
        velocities = np.where(flies, cubic.slope(u) / width, self.velocities[k])
        return positions, velocities

    def covariance(self, times: np.ndarray) -> np.ndarray:
        """Return the covariances (m, 6, 6) at times (m,) inside the path, by linear interpolation."""
        k, u, _ = self._within(times)
        u = u[:, None, None]
        return self.covariances[k] * (1 - u) + self.covariances[k + 1] * u

    def bounced(self, times: np.ndarray) -> np.ndarray:
        """Return the number of bounces before times (m,); a contact counts half."""
        k = self._before(times)
        return (self.bounces[k] + self.bounces[k + 1]) / 2

    def since_bounce(self, times: np.ndarray) -> np.ndarray:
        """Return the time (m,), s, since the last bounce of this path before times (m,); inf without one."""
        k = self._before(times)
        ends = np.flatnonzero(np.diff(self.bounces)) + 1
        last = np.searchsorted(ends, k, side="right") - 1
        return np.where(last >= 0, times - self.times[ends[last]], np.inf) if len(ends) else np.full(len(times), np.inf)

    def first_time_near(self, points: np.ndarray, distance: float) -> float:
        """Return the first time (s) at which the ball is within `distance` (m) of one of the points (n, 3), or inf."""
        times = np.arange(self.times[0], self.times[-1], NEAR_STEP_S)
        places, _ = self.at(times)
        away = np.linalg.norm(places[:, None] - points, axis=2).min(axis=1, initial=np.inf)
        near = np.flatnonzero(away < distance)
        return float(times[near[0]]) if len(near) else np.inf

    def _within(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the intervals (m,) that contain times (m,), the places in them, 0 to 1, (m,), and lengths, (m, 1)."""
        k = self._before(times)
        width = np.maximum(self.times[k + 1] - self.times[k], 1e-12)
        return k, np.clip((times - self.times[k]) / width, 0.0, 1.0), width[:, None]

    def _before(self, times: np.ndarray) -> np.ndarray:
        return np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 2)


def predict(
    transition: Transition, time: float, mean: np.ndarray, covariance: np.ndarray, until: float, bounces: int
) -> Path:
    """Return the path of a ball from `time` to `until` (s), or to the bounce after `bounces` bounces."""
    states = [(time, mean, covariance, 0)]
    done, dwell = 0, transition.dwell
    while time < until - 1e-9:
        step = min(STEP_S, until - time)
        fall = transition.time_to_bounce(mean, step)
        mean, covariance = transition.fly(mean, covariance, step if fall is None else fall)
        time += step if fall is None else fall
        states.append((time, mean, covariance, done))
        if fall is not None:
            if done == bounces:
                break
            mean, covariance = transition.bounce(mean, covariance)
            time += dwell
            done += 1
            states.append((time, mean, covariance, done))
            if mean[5] < ROLLING_M_S:
                break
    if len(states) == 1:
        states.append((time + 1e-6, mean, covariance, done))
    means = np.array([state[1] for state in states])
    return Path(
        np.array([state[0] for state in states]),
        means[:, POSITION],
        means[:, VELOCITY],
        np.array([state[2][:6, :6] for state in states]),
        np.array([state[3] for state in states]),
        transition.air(means[0]),
    )
