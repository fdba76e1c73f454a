"""The jerk-limited stop after a hit or a cancel (design 1.9).

Ruckig plans the stop that is played. The closed form beside it tells where a stop would lead, for many
states at once and without allocating a trajectory; both are held against each other in the tests.
"""

from dataclasses import dataclass

import numpy as np
import ruckig

from motion.errors import SolverFailed
from motion.limits import Limits
from motion.samples import Samples

UNLIMITED = 1e9
"""What an acceleration (rad/s²) or jerk (rad/s³) without limit counts as, so that a stop takes some time."""

ARRIVED = 1e-10
"""From this many seconds before its end on a joint is exactly at rest: of a stop that lasts whole ticks the last sample
may lie before the end by rounding."""

TOUCH = 1e-9
"""A stop may end beyond a limit by this much (rad, rad/s): rounding, not motion."""


@dataclass(frozen=True, slots=True, eq=False)
class Stop:
    """A stop of J joints, each as fast as its own limits allow.

    Each joint runs through at most K pieces of constant jerk: `knots` (J, K+1) are their times, `states` (3, J, K+1)
    position, velocity and acceleration there, `jerks` (J, K+1) the jerk from there on; at the last knot, which a joint
    with fewer pieces has several times, it is at rest.
    """

    duration: float
    knots: np.ndarray
    states: np.ndarray
    jerks: np.ndarray

    def sample(self, times: np.ndarray) -> Samples:
        """States at `times` (n,), s from the start of the stop; exactly at rest from `duration` on."""
        times = np.asarray(times, dtype=float)
        out = np.empty((3, len(times), len(self.knots)))
        for joint, knots in enumerate(self.knots):
            piece = np.maximum(np.searchsorted(knots, times, side="right") - 1, 0)
            piece[times >= knots[-1] - ARRIVED] = len(knots) - 1
            p, v, a = self.states[:, joint, piece]
            j = self.jerks[joint, piece]
            t = times - knots[piece]
            out[0, :, joint] = p + t * (v + t * (a / 2 + t * j / 6))
            out[1, :, joint] = v + t * (a + t * j / 2)
            out[2, :, joint] = a + t * j
        return Samples(*out)

    @property
    def final_positions(self) -> np.ndarray:
        """Positions (J,) at rest, rad."""
        return self.states[0, :, -1]

    def extremes(self) -> np.ndarray:
        """Lowest and highest position, velocity, acceleration and jerk (J, 4, 2) over the whole stop.

        Within a piece the velocity turns only where the first acceleration has gone, and the position where the arm
        moves against the way it stops in.
        """
        extremes = np.empty((len(self.knots), 4, 2))
        extremes[:, :3, 0], extremes[:, 3, 0] = self.states.min(axis=2).T, self.jerks.min(axis=1)
        extremes[:, :3, 1], extremes[:, 3, 1] = self.states.max(axis=2).T, self.jerks.max(axis=1)
        p, v, a = self.states[:, :, 0]
        jerk = np.maximum(np.abs(self.jerks).max(axis=1), 1e-300)
        peak = v + a * np.abs(a) / (2 * jerk)
        extremes[:, 1, 0] = np.minimum(extremes[:, 1, 0], peak)
        extremes[:, 1, 1] = np.maximum(extremes[:, 1, 1], peak)
        backward = np.flatnonzero(v * peak < 0)
        if backward.size:
            p, v, a, jerk = (values[backward] for values in (p, v, a, jerk))
            # How long the jerk −J·sign(a) takes to bring v to 0, in the form that does not cancel.
            time = -2 * v / (a + np.copysign(np.sqrt(np.maximum(a * a - 2 * jerk * np.abs(v), 0.0)), a))
            turn = p + time * (v + time * (a / 2 - np.copysign(jerk, a) * time / 6))
            extremes[backward, 0, 0] = np.minimum(extremes[backward, 0, 0], turn)
            extremes[backward, 0, 1] = np.maximum(extremes[backward, 0, 1], turn)
        return extremes


def stop(positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray, limits: Limits) -> Stop:
    """The fastest stop from a state (J,) inside the acceleration and jerk limits.

    Position and velocity limits are not looked at: see `Stop.extremes`, `stops_inside`. States in rad, rad/s, rad/s².
    Raises SolverFailed where Ruckig finds none, which happens for accelerations of 10⁶ rad/s² and more and where the
    acceleration takes hours to go.
    """
    count = len(velocities)
    wanted = ruckig.InputParameter(count)
    wanted.control_interface = ruckig.ControlInterface.Velocity
    wanted.synchronization = ruckig.Synchronization.No
    state = [np.asarray(values).tolist() for values in (positions, velocities, accelerations)]
    _, wanted.current_velocity, wanted.current_acceleration = state
    wanted.max_acceleration = np.minimum(limits.accelerations, UNLIMITED).tolist()
    wanted.max_jerk = np.minimum(limits.jerks, UNLIMITED).tolist()
    trajectory = ruckig.Trajectory(count)
    try:
        ruckig.Ruckig(count).calculate(wanted, trajectory)
    except (ruckig.RuckigError, ValueError):  # a ValueError for the results that its binding does not know
        raise SolverFailed(int(np.abs(accelerations).argmax()), "Ruckig found no stop") from None
    joints = zip(*state, trajectory.profiles[0], strict=True)
    each = [_knots(*joint) for joint in joints]
    most = max(map(len, each))
    knots = np.array([[*few, *few[-1:] * (most - len(few))] for few in each]).transpose(2, 0, 1)
    return Stop(float(knots[0, :, -1].max()), knots[0], knots[1:4], knots[4])


def _knots(p: float, v: float, a: float, profile: ruckig.Profile) -> list[tuple[float, float, float, float, float]]:
    """Time, position, velocity, acceleration and jerk at the knots of one joint's stop, the last one at rest.

    Of numbers instead of arrays: one joint has so few of them that arrays take longer.
    """
    knots, now = [], 0.0
    for t, j in zip((*profile.brake.t, *profile.t), (*profile.brake.j, *profile.j), strict=True):
        if t > 0:
            knots.append((now, p, v, a, j))
            now += t
            p, v, a = p + t * (v + t * (a / 2 + t * j / 6)), v + t * (a + t * j / 2), a + t * j
    return [*knots, (now, p, 0.0, 0.0, 0.0)]


def stop_extremes(
    positions: np.ndarray,
    velocities: np.ndarray,
    accelerations: np.ndarray,
    max_accelerations: np.ndarray,
    max_jerks: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Lowest and highest position and velocity (p_min, p_max, v_min, v_max) of the stop from each state.

    Any shapes that broadcast, for instance (n, J) states with (J,) limits. Closed form: seen in the direction
    in which v + a|a|/2J is positive, the stop is jerk −J down to the acceleration −a_p, a hold, and jerk +J
    back to zero, with a_p = min(√(Jv + a²/2), A). The velocity turns where a crosses 0, the position where v
    does, which can only happen while a is still positive.
    """
    limit = np.minimum(max_accelerations, UNLIMITED)
    jerk = np.minimum(max_jerks, UNLIMITED)
    sign = np.where(velocities + accelerations * np.abs(accelerations) / (2 * jerk) >= 0, 1.0, -1.0)
    v, a = sign * velocities, sign * accelerations
    rising = np.maximum(a, 0.0)
    # An acceleration already beyond the limit is held, not passed.
    peak = np.maximum(np.minimum(np.sqrt(np.maximum(jerk * v + a * a / 2, 0.0)), limit), -a)
    t1 = (a + peak) / jerk
    v1 = v + t1 * (a - jerk * t1 / 2)
    # Held is only the limit itself; elsewhere what is left of the velocity is rounding.
    held = np.where(peak >= limit, np.maximum(v1 - peak * peak / (2 * jerk), 0.0), 0.0) / np.maximum(peak, 1e-300)
    travel = t1 * (v + t1 * (a / 2 - t1 * jerk / 6)) + held * (v1 - peak * held / 2) + peak**3 / (6 * jerk**2)
    back = np.minimum(v, 0.0)
    root = np.sqrt(np.maximum(rising * rising + 2 * jerk * back, 0.0))
    t0 = -2 * back / np.maximum(rising + root, 1e-300)
    dip = t0 * (back + t0 * (rising / 2 - t0 * jerk / 6))
    low, high = np.minimum(dip, travel), np.maximum(travel, 0.0)
    slow, fast = back, np.maximum(v + rising * rising / (2 * jerk), 0.0)
    return (
        positions + np.where(sign > 0, low, -high),
        positions + np.where(sign > 0, high, -low),
        np.where(sign > 0, slow, -fast),
        np.where(sign > 0, fast, -slow),
    )


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
