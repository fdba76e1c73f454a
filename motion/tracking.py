"""The tracking law of the 1 kHz loop, eq. 11."""

import numpy as np

from motion.braking import UNLIMITED
from motion.limits import Limits

State = tuple[np.ndarray, np.ndarray, np.ndarray]


def tracking_acceleration(
    alpha: float, reference: State, positions: np.ndarray, velocities: np.ndarray, out: np.ndarray | None = None
) -> np.ndarray:
    """Acceleration ÿ = α(β(g − y) + ġ − v) + g̈ with β = α/4 (eq. 11), critically damped.

    alpha: gain, 1/s. reference: g, ġ, g̈, each (J,). positions, velocities: measured y and v, (J,).
    Returns (J,) in rad/s², written into `out` if that is given (it must not alias an input).
    """
    goal, goal_velocity, goal_acceleration = reference
    out = np.subtract(goal, positions, out=out)
    out *= alpha / 4
    out += goal_velocity
    out -= velocities
    out *= alpha
    out += goal_acceleration
    return out


def returning_acceleration(
    alpha: float, reference: State, positions: np.ndarray, velocities: np.ndarray, limits: Limits, tick: float
) -> np.ndarray:
    """Acceleration by eq. 11 that returns an arm to its reference inside `limits`, from any state.

    The approach speed is limited to what half of the acceleration limit can brake; near the reference the law is eq.
    11. tick: s, for which the acceleration is held. Other arguments and result: as `tracking_acceleration`. See
    "Recoil" in docs/derivations.md.
    """
    goal, goal_velocity, goal_acceleration = reference
    error, beta = goal - positions, alpha / 4
    brakes = np.minimum(limits.accelerations, UNLIMITED) / 2
    linear = brakes / beta**2
    far = np.maximum(np.abs(error), linear)
    approach = np.where(far > linear, np.sign(error) * np.sqrt(brakes * (2 * far - linear)), beta * error)
    wanted = alpha * (approach + goal_velocity - velocities) + goal_acceleration
    return _admissible(wanted, positions, velocities, limits, tick)


def _admissible(
    wanted: np.ndarray, positions: np.ndarray, velocities: np.ndarray, limits: Limits, tick: float
) -> np.ndarray:
    """Return the accelerations nearest to `wanted` that keep the limits, now and until the arm can stop.

    A velocity that exceeds its limit, or is too high to stop before the end of a joint, is braked at the full limit.
    """
    most = np.minimum(limits.accelerations, UNLIMITED)
    low, high = limits.positions.T
    fastest = np.minimum(limits.velocities, _stoppable(high - positions, velocities, most, tick))
    slowest = -np.minimum(limits.velocities, _stoppable(positions - low, -velocities, most, tick))
    least, greatest = (np.clip((bound - velocities) / tick, -most, most) for bound in (slowest, fastest))
    return np.clip(wanted, least, greatest)


def _stoppable(room: np.ndarray, speed: np.ndarray, brakes: np.ndarray, tick: float) -> np.ndarray:
    """Return the highest speed after one tick from `speed` at which `brakes` can stop within `room` (J,), rad."""
    left = np.maximum(room - speed * tick / 2, -brakes * tick**2 / 8)
    return brakes * (np.sqrt(tick**2 / 4 + 2 * left / brakes) - tick / 2)
