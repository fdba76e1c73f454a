"""The jerk-limited stop after a hit or a cancel, in closed form."""

import math
from typing import Any, NamedTuple

import numpy as np

from motion.limits import Limits
from motion.trajectory import COEFFICIENTS, Samples, Trajectory

UNLIMITED = 1e9
"""Stand-in for an acceleration (rad/s²) or jerk (rad/s³) without a limit, so that a stop has a finite duration."""

STOP_ROUNDING = 1e-9
"""A stop may exceed a limit by this much (rad, rad/s), which is rounding."""


class Floats:
    """The numpy functions that a stop needs, for single floats: ten times faster than arrays of one element."""

    minimum, maximum, sqrt = min, max, math.sqrt

    @staticmethod
    def where(condition: bool, then: float, otherwise: float) -> float:
        """Return `then` if the condition holds, `otherwise` if not."""
        return then if condition else otherwise


class Stop(NamedTuple):
    """The fastest stop from each state, mirrored by `sign` such that v + a|a|/2J is positive.

    Jerk −J lasts `bending` s and ends at the acceleration −`peak`, which is held for `held` s; jerk +J returns it to
    zero. velocity, acceleration: of the state, times `sign`. Fields are arrays that broadcast, or floats; pass `numpy`
    or `Floats` as `xp` to the methods accordingly.
    """

    sign: Any
    velocity: Any
    acceleration: Any
    jerk: Any
    peak: Any
    bending: Any
    held: Any

    @property
    def duration(self) -> Any:
        """Duration of the stop, s."""
        return self.bending + self.held + self.peak / self.jerk

    def extremes(self, positions: Any, xp: Any = np) -> tuple[Any, Any, Any, Any]:
        """Lowest and highest position, lowest and highest velocity, of stops that begin at `positions`.

        The velocity has an extremum where the acceleration crosses 0, the position where the velocity does. The latter
        happens only while the acceleration is still positive.
        """
        sign, v, a, jerk, peak, t1, held = self
        rising, back = xp.maximum(a, 0.0), xp.minimum(v, 0.0)
        v1 = v + t1 * (a - jerk * t1 / 2)
        travel = t1 * (v + t1 * (a / 2 - t1 * jerk / 6)) + held * (v1 - peak * held / 2) + peak**3 / (6 * jerk**2)
        root = xp.sqrt(xp.maximum(rising * rising + 2 * jerk * back, 0.0))
        t0 = -2 * back / xp.maximum(rising + root, 1e-300)
        end = positions + sign * travel
        turn = positions + sign * t0 * (back + t0 * (rising / 2 - t0 * jerk / 6))
        first, fastest = sign * v, sign * (v + rising * rising / (2 * jerk))
        return (
            xp.minimum(xp.minimum(positions, end), turn),
            xp.maximum(xp.maximum(positions, end), turn),
            xp.minimum(xp.minimum(first, fastest), 0.0),
            xp.maximum(xp.maximum(first, fastest), 0.0),
        )

    def reach(self, positions: Any, xp: Any = np) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Lowest and highest position, velocity, acceleration and jerk of stops that begin at `positions`."""
        p_min, p_max, v_min, v_max = self.extremes(positions, xp)
        first, held = self.sign * self.acceleration, -self.sign * self.peak
        bending = -self.sign * xp.where(self.bending > 0, self.jerk, 0.0)
        ending = self.sign * xp.where(self.peak > 0, self.jerk, 0.0)
        lowest = p_min, v_min, xp.minimum(xp.minimum(first, held), 0.0), xp.minimum(bending, ending)
        return lowest, (p_max, v_max, xp.maximum(xp.maximum(first, held), 0.0), xp.maximum(bending, ending))

    def trajectory(self, positions: np.ndarray) -> Trajectory:
        """The stop of J joints from `positions` (J,). Its last piece has no duration and is at rest."""
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


def fastest_stop(velocities: Any, accelerations: Any, max_accelerations: Any, max_jerks: Any, xp: Any = np) -> Stop:
    """Return the fastest stop from each state inside the acceleration and jerk limits: rad/s, rad/s², rad/s³.

    Any shapes that broadcast, for instance (n, J) states with (J,) limits; or numbers, with `Floats` as `xp`.
    """
    limit, jerk = xp.minimum(max_accelerations, UNLIMITED), xp.minimum(max_jerks, UNLIMITED)
    sign = xp.where(velocities + accelerations * abs(accelerations) / (2 * jerk) >= 0, 1.0, -1.0)
    v, a = sign * velocities, sign * accelerations
    # An initial acceleration beyond the limit is held, not increased.
    peak = xp.maximum(xp.minimum(xp.sqrt(xp.maximum(jerk * v + a * a / 2, 0.0)), limit), -a)
    bending = (a + peak) / jerk
    left = v + bending * (a - jerk * bending / 2) - peak * peak / (2 * jerk)
    # Only the limit is held; below it the remaining velocity is rounding.
    held = xp.where(peak >= limit, xp.maximum(left, 0.0), 0.0) / xp.maximum(peak, 1e-300)
    return Stop(sign, v, a, jerk, peak, bending, held)


def stop(positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray, limits: Limits) -> Trajectory:
    """Return the fastest stop of J joints from a state (J,): rad, rad/s, rad/s².

    It keeps acceleration and jerk limits only; `first_stop` also checks positions and velocities.
    """
    return fastest_stop(velocities, accelerations, limits.accelerations, limits.jerks).trajectory(positions)


def first_stop(samples: Samples, limits: Limits) -> int | None:
    """Index of the first sample from which a stop keeps the position and velocity limits; None if no sample does."""
    stop = fastest_stop(samples.velocities, samples.accelerations, limits.accelerations, limits.jerks)
    p_min, p_max, v_min, v_max = stop.extremes(samples.positions)
    inside = (p_min >= limits.positions[:, 0] - STOP_ROUNDING) & (p_max <= limits.positions[:, 1] + STOP_ROUNDING)
    inside &= (v_min >= -limits.velocities - STOP_ROUNDING) & (v_max <= limits.velocities + STOP_ROUNDING)
    each = inside.all(axis=1)
    return int(each.argmax()) if each.any() else None
