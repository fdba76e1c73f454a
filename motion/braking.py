"""The jerk-limited stop after a hit or a cancel, in closed form."""

from typing import NamedTuple

import numpy as np

from motion.limits import Limits
from motion.trajectory import COEFFICIENTS, Samples, Trajectory

UNLIMITED = 1e9
"""What an acceleration (rad/s²) or jerk (rad/s³) without limit counts as, so that a stop takes some time."""

TOUCH = 1e-9
"""A stop may end beyond a limit by this much (rad, rad/s): rounding, not motion."""


class Stop(NamedTuple):
    """The fastest stop from each state, seen in the direction `sign` in which v + a|a|/2J is positive.

    Jerk −J for `bending` s down to the acceleration −`peak`, which is held for `held` s, and jerk +J back to zero.
    Arrays that broadcast; velocity, acceleration: of the state, with the sign.
    """

    sign: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    jerk: np.ndarray
    peak: np.ndarray
    bending: np.ndarray
    held: np.ndarray

    @property
    def duration(self) -> float:
        """Until all are at rest, s."""
        return float((self.bending + self.held + self.peak / self.jerk).max())

    def extremes(self, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Lowest and highest position and velocity of stops that begin at `positions`.

        The velocity turns where the acceleration crosses 0, the position where the velocity does, which can only happen
        while the acceleration is still positive.
        """
        low, high, back, fast = self._ahead()
        ahead = self.sign > 0
        return (
            positions + np.where(ahead, low, -high),
            positions + np.where(ahead, high, -low),
            np.where(ahead, back, -fast),
            np.where(ahead, fast, -back),
        )

    def reach(self, positions: np.ndarray) -> np.ndarray:
        """Return the extremes of position, velocity, acceleration and jerk (J, 4, 2) of stops from `positions` (J,)."""
        low, high, back, fast = self._ahead()
        first, last = np.where(self.bending > 0, self.jerk, 0.0), np.where(self.peak > 0, self.jerk, 0.0)
        lowest = np.array([low, back, -self.peak, -first])
        highest = np.array([high, fast, np.maximum(self.acceleration, 0.0), last])
        bounds = np.where(self.sign > 0, (lowest, highest), (-highest, -lowest))
        bounds[:, 0] += positions
        return bounds.T

    def _ahead(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Least and largest way, lowest and highest velocity, in the direction of the sign."""
        _, v, a, jerk, peak, t1, held = self
        rising = np.maximum(a, 0.0)
        v1 = v + t1 * (a - jerk * t1 / 2)
        travel = t1 * (v + t1 * (a / 2 - t1 * jerk / 6)) + held * (v1 - peak * held / 2) + peak**3 / (6 * jerk**2)
        fast = np.maximum(v + rising * rising / (2 * jerk), 0.0)
        low, back = np.minimum(travel, 0.0), np.minimum(v, 0.0)
        if back.any():
            root = np.sqrt(np.maximum(rising * rising + 2 * jerk * back, 0.0))
            t0 = -2 * back / np.maximum(rising + root, 1e-300)
            low = np.minimum(low, t0 * (back + t0 * (rising / 2 - t0 * jerk / 6)))
        return low, np.maximum(travel, 0.0), back, fast

    def trajectory(self, positions: np.ndarray) -> Trajectory:
        """The motion of J joints that stop from `positions` (J,). The last piece, of no length, is at rest."""
        spans = np.stack([self.bending, self.held, self.peak / self.jerk], axis=1)
        knots = np.zeros((len(spans), 4))
        spans.cumsum(axis=1, out=knots[:, 1:])
        jerks = (self.sign * self.jerk)[:, None] * _JERKS
        states = np.zeros((3, len(spans), 4))
        states[:, :, 0] = positions, self.sign * self.velocity, self.sign * self.acceleration
        for k in range(3):
            (p, v, a), t, j = states[:, :, k], spans[:, k], jerks[:, k]
            states[:, :, k + 1] = p + t * (v + t * (a / 2 + t * j / 6)), v + t * (a + t * j / 2), a + t * j
        states[1:, :, 3] = 0.0
        breaks = np.array(sorted(set(knots.ravel().tolist())))
        phase = (breaks >= knots[:, 1:, None]).sum(axis=1)
        joint = np.arange(len(knots))[:, None]
        p, v, a = states[:, joint, phase]
        j, t = jerks[joint, phase], breaks - knots[joint, phase]
        coefficients = np.zeros((len(breaks), len(knots), COEFFICIENTS))
        coefficients[:, :, 0] = (p + t * (v + t * (a / 2 + t * j / 6))).T
        coefficients[:, :, 1] = (v + t * (a + t * j / 2)).T
        coefficients[:, :, 2] = (a + t * j).T / 2
        coefficients[:, :, 3] = j.T / 6
        return Trajectory(np.append(breaks, breaks[-1]), coefficients)


_JERKS = np.array([-1.0, 0.0, 1.0, 0.0])


def fastest_stop(
    velocities: np.ndarray, accelerations: np.ndarray, max_accelerations: np.ndarray, max_jerks: np.ndarray
) -> Stop:
    """Return the fastest stop from each state inside the acceleration and jerk limits: rad/s, rad/s², rad/s³.

    Any shapes that broadcast, for instance (n, J) states with (J,) limits.
    """
    limit, jerk = np.minimum(max_accelerations, UNLIMITED), np.minimum(max_jerks, UNLIMITED)
    sign = np.where(velocities + accelerations * np.abs(accelerations) / (2 * jerk) >= 0, 1.0, -1.0)
    v, a = sign * velocities, sign * accelerations
    # An acceleration already beyond the limit is held, not passed.
    peak = np.maximum(np.minimum(np.sqrt(np.maximum(jerk * v + a * a / 2, 0.0)), limit), -a)
    bending = (a + peak) / jerk
    left = v + bending * (a - jerk * bending / 2) - peak * peak / (2 * jerk)
    # Only the limit itself is held; elsewhere what is left of the velocity is rounding.
    held = np.where(peak >= limit, np.maximum(left, 0.0), 0.0) / np.maximum(peak, 1e-300)
    return Stop(sign, v, a, jerk, peak, bending, held)


def stop(positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray, limits: Limits) -> Trajectory:
    """Return the fastest stop of J joints from a state (J,): rad, rad/s, rad/s².

    Position and velocity limits are not looked at: see `stop_extremes`, `stops_inside`.
    """
    return fastest_stop(velocities, accelerations, limits.accelerations, limits.jerks).trajectory(positions)


def stop_extremes(
    positions: np.ndarray,
    velocities: np.ndarray,
    accelerations: np.ndarray,
    max_accelerations: np.ndarray,
    max_jerks: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the extremes (p_min, p_max, v_min, v_max) of the stop from each state; all shapes must broadcast."""
    return fastest_stop(velocities, accelerations, max_accelerations, max_jerks).extremes(positions)


def stops_inside(
    positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray, limits: Limits
) -> np.ndarray:
    """Whether the stop from each state (…, J) stays inside the position and velocity limits: bool (…, J)."""
    p_min, p_max, v_min, v_max = stop_extremes(positions, velocities, accelerations, limits.accelerations, limits.jerks)
    return (
        (p_min >= limits.positions[:, 0] - TOUCH)
        & (p_max <= limits.positions[:, 1] + TOUCH)
        & (v_min >= -limits.velocities - TOUCH)
        & (v_max <= limits.velocities + TOUCH)
    )


def first_stop(samples: Samples, limits: Limits) -> int | None:
    """Index of the first sample from which the stop stays inside the position and velocity limits.

    None where there is no such sample.
    """
    inside = stops_inside(samples.positions, samples.velocities, samples.accelerations, limits).all(axis=1)
    return int(inside.argmax()) if inside.any() else None
