"""Estimate the state of a ball from its sights: an extended Kalman filter with bounces."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from robot.striking.flight import GRAVITY, Ball, Court
from robot.striking.path import Path, predict
from robot.striking.transition import DRAG, POSITION, RESTITUTION, SIZE, VELOCITY, WIND, Transition

Sight = Literal["started", "used", "contact", "rejected", "new ball"]

GATE = 8.0
"""Standard deviations from the prediction above which a sight is rejected."""
NEW_BALL_SIGHTS = 3
"""Number of consecutive rejected sights, consistent with each other, that start a new ball."""
MAX_SPEED = 60.0
"""m/s; two sights that imply a higher speed are not of one ball."""
MAX_GAP_S = 0.5
"""s without a sight after which the next one starts a new ball."""
BOUNCE_MARGIN_S = 0.004
"""Sights within this time of a bounce, s, or within two standard deviations of the surface, are not used."""


class NoBall(Exception):
    """No ball was seen twice."""

    def __init__(self) -> None:
        super().__init__("no ball was seen twice; wait for two sights")


@dataclass(frozen=True, slots=True)
class NoiseModel:
    """Noise of sights, uncertainty of parameters, process noise.

    Attributes:
        position_std: Of a sight, m.
        velocity_std: Of a sight's velocity, m/s.
        restitution_std: Of the surface's restitution, before the first bounce.
        drag_std: Of the drag, before the first sight, as a part of the ball's drag.
        wind_std: Of the wind, before the first sight, m/s².
        latency: Age of a sight at its time stamp, s.
        unmodelled: Process noise of the acceleration, m/s per √s.
    """

    position_std: float = 0.005
    velocity_std: float = 0.01
    restitution_std: float = 0.05
    drag_std: float = 0.1
    wind_std: tuple[float, float, float] = (0.0, 0.0, 0.0)
    latency: float = 0.0
    unmodelled: float = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Estimate at `time` (s): mean (11,) and covariance (11, 11) of position, velocity, wind, drag, restitution.

    bounces, sights: number since the ball is followed.
    """

    time: float
    mean: np.ndarray
    covariance: np.ndarray
    bounces: int
    sights: int

    @property
    def position(self) -> np.ndarray:
        """Position (3,), m."""
        return self.mean[POSITION]

    @property
    def velocity(self) -> np.ndarray:
        """Velocity (3,), m/s."""
        return self.mean[VELOCITY]

    @property
    def restitution(self) -> float:
        """Restitution of the surface."""
        return float(self.mean[RESTITUTION])


class Estimator:
    """Follows one ball. Its clock is that of the sights; `NoiseModel` has its assumptions."""

    def __init__(self, ball: Ball, court: Court, noise: NoiseModel | None = None) -> None:
        self.ball = ball
        self.court = court
        self.noise = noise or NoiseModel()
        self._transition = Transition(ball, court.surface, self.noise.unmodelled)
        self.reset()

    def reset(self) -> None:
        """Forget the ball."""
        self.estimate: Estimate | None = None
        self._first: tuple[float, np.ndarray] | None = None
        self._rejected: list[tuple[float, np.ndarray]] = []
        self._used = -np.inf

    def observe(
        self,
        time: float,
        position: np.ndarray,
        velocity: np.ndarray | None = None,
        spin: np.ndarray | None = None,
    ) -> Sight:
        """Process a sight: position (3,), m, and velocity (3,), m/s, if known; return how it was used.

        "contact": too near a bounce to be used. "rejected": not finite, not later than the previous sight, or too far
        from the prediction. "new ball": the last rejected sights agree with each other, and are followed from now on.
        """
        time = time - self.noise.latency
        position = np.asarray(position, dtype=float)
        velocity = None if velocity is None else np.asarray(velocity, dtype=float)
        if not (np.isfinite(time) and np.isfinite(position).all()):
            return "rejected"
        if velocity is not None and not np.isfinite(velocity).all():
            velocity = None
        if spin is not None and np.isfinite(spin).all():
            self._transition.spin = np.asarray(spin, dtype=float)
        newest = self.estimate.time if self.estimate else self._first[0] if self._first else -np.inf
        if time <= newest:
            return "rejected"
        if time - newest > MAX_GAP_S and np.isfinite(newest):
            self.reset()
        if self.estimate is None:
            return self._start(time, position, velocity)
        return self._follow(self.estimate, time, position, velocity)

    def age(self, now: float) -> float:
        """Return the time (s) since the last used sight; inf if none was used."""
        return now - self.noise.latency - self._used

    def path(self, until: float) -> Path:
        """Predict the ball until a time (s), or until it has bounced once more than the court allows.

        Raises:
            NoBall: it was not seen twice.
        """
        now = self.estimate
        if now is None:
            raise NoBall
        left = max(self.court.bounces - now.bounces, 0)
        return predict(self._transition, now.time, now.mean, now.covariance, max(until, now.time + 1e-3), left)

    def _start(self, time: float, position: np.ndarray, velocity: np.ndarray | None) -> Sight:
        noise, variance = self.noise, self.noise.position_std**2
        mean, covariance = np.zeros(SIZE), np.zeros((SIZE, SIZE))
        if velocity is not None:
            mean[VELOCITY] = velocity
            covariance[VELOCITY, VELOCITY] = np.eye(3) * noise.velocity_std**2
        elif self._first is None:
            self._first = time, position
            return "started"
        else:
            began, first = self._first
            gap = time - began
            if np.linalg.norm(position - first) > MAX_SPEED * gap + GATE * noise.position_std:
                self._first = time, position
                return "new ball"
            mean[VELOCITY] = (position - first) / gap
            mean[5] -= GRAVITY * gap / 2
            covariance[VELOCITY, VELOCITY] = np.eye(3) * (2 * variance / gap**2 + (0.5 * gap) ** 2)
            covariance[POSITION, VELOCITY] = covariance[VELOCITY, POSITION] = np.eye(3) * variance / gap
        mean[POSITION], mean[DRAG] = position, self.ball.drag
        mean[RESTITUTION] = self.court.surface.restitution
        covariance[POSITION, POSITION] = np.eye(3) * variance
        covariance[WIND, WIND] = np.diag(np.square(noise.wind_std))
        covariance[DRAG, DRAG] = (noise.drag_std * self.ball.drag) ** 2
        covariance[RESTITUTION, RESTITUTION] = noise.restitution_std**2
        self.estimate = Estimate(time, mean, covariance, 0, 1 if velocity is not None else 2)
        self._first, self._rejected, self._used = None, [], time
        return "started"

    def _follow(self, now: Estimate, time: float, position: np.ndarray, velocity: np.ndarray | None) -> Sight:
        mean, covariance, bounces = self._transition.advance(now.mean, now.covariance, time - now.time)
        bounces += now.bounces
        if self._near_bounce(mean, covariance):
            self.estimate = Estimate(time, mean, covariance, bounces, now.sights)
            return "contact"
        seen = np.eye(3, SIZE) if velocity is None else np.eye(6, SIZE)
        noise = [self.noise.position_std**2] * 3 + ([] if velocity is None else [self.noise.velocity_std**2] * 3)
        value = position if velocity is None else np.concatenate([position, velocity])
        innovation = value - seen @ mean
        inner = seen @ covariance @ seen.T + np.diag(noise)
        if innovation @ np.linalg.solve(inner, innovation) > GATE**2 * len(value) / 3:
            self.estimate = Estimate(time, mean, covariance, bounces, now.sights)
            return self._reject(time, position, velocity)
        gain = np.linalg.solve(inner, seen @ covariance).T
        reduction = np.eye(SIZE) - gain @ seen
        covariance = reduction @ covariance @ reduction.T + gain * noise @ gain.T
        self.estimate = Estimate(time, mean + gain @ innovation, covariance, bounces, now.sights + 1)
        self._rejected, self._used = [], time
        return "used"

    def _near_bounce(self, mean: np.ndarray, covariance: np.ndarray) -> bool:
        """Return whether a ball of this state may touch the surface."""
        height = mean[2] - self.court.surface.height - self.ball.radius
        return bool(height < 2 * np.sqrt(covariance[2, 2]) + abs(mean[5]) * BOUNCE_MARGIN_S)

    def _reject(self, time: float, position: np.ndarray, velocity: np.ndarray | None) -> Sight:
        self._rejected.append((time, position))
        if len(self._rejected) < NEW_BALL_SIGHTS:
            return "rejected"
        (began, first), *_ = self._rejected[-NEW_BALL_SIGHTS:]
        if np.linalg.norm(position - first) > MAX_SPEED * (time - began):
            self._rejected = self._rejected[-NEW_BALL_SIGHTS:]
            return "rejected"
        (began, first) = self._rejected[-2]
        self.reset()
        self._first = began, first
        self._start(time, position, velocity)
        return "new ball"
