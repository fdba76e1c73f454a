"""A quick estimate of how much of its limits an arm uses, for many motions: quintics between their end states."""

import numpy as np

from motion.limits import Limits

SAMPLES = 20
ROUNDING = 1e-9
"""rad, rounding by which a limit may be exceeded."""


def _basis() -> np.ndarray:
    """Return the Hermite quintics and their derivatives at the samples, (4 derivatives, 1, 4 of the 6, samples).

    They belong to the start's velocity and acceleration, the distance, and the final velocity, in normalised time.
    """
    s = np.linspace(0.0, 1.0, SAMPLES)
    coefficients = [
        [0, 1, 0, -6, 8, -3],
        [0, 0, 0.5, -1.5, 1.5, -0.5],
        [0, 0, 0, 10, -15, 6],
        [0, 0, 0, -4, 7, -3],
    ]
    polynomials = [np.polynomial.Polynomial(c) for c in coefficients]
    return np.array([[p.deriv(n)(s) if n else p(s) for p in polynomials] for n in range(4)])[:, None]


_BASIS = _basis()
_ORDERS = np.arange(1, 4)[:, None, None]


def quintic_use(
    limits: Limits,
    start: tuple[np.ndarray, np.ndarray, np.ndarray],
    positions: np.ndarray,
    velocities: np.ndarray,
    durations: np.ndarray,
    follow_through: float,
) -> np.ndarray:
    """Return the largest part (n,) of any limit that motions from `start` to final states (n, J) use.

    start: positions, velocities, accelerations (J,). durations: (n,), s. The final acceleration is 0. A position limit
    counts as 0 if kept, as at least 2 if exceeded. inf if the arm, after `follow_through` (s) with the final
    velocities, cannot stop inside its ranges: the planner refuses such states.
    """
    q, v, a = start
    t = durations[:, None]
    ends = np.stack([t * v, t * t * a, positions - q, t * velocities], axis=2)
    curves = ends @ _BASIS  # (4 derivatives, n, J, samples)
    scales = np.stack([limits.velocities, limits.accelerations, limits.jerks])[:, None] * t**_ORDERS
    use = (np.abs(curves[1:]).max(axis=3) / scales).max(axis=(0, 2))
    way = q[:, None] + curves[0]
    low, high = limits.positions.T
    outside = ((way < low[:, None] - ROUNDING) | (way > high[:, None] + ROUNDING)).any(axis=(1, 2))
    rest = positions + follow_through * velocities + np.sign(velocities) * stopping_distance(limits, np.abs(velocities))
    cannot_stop = ((rest < low - ROUNDING) | (rest > high + ROUNDING)).any(axis=1)
    return np.where(cannot_stop, np.inf, np.where(outside, np.maximum(use, 2.0), use))


def stopping_distance(limits: Limits, speeds: np.ndarray) -> np.ndarray:
    """Return the lengths (n, J), rad, of the fastest stops from speeds (n, J), rad/s, at zero acceleration."""
    bends = limits.accelerations / limits.jerks
    slow = speeds * np.sqrt(speeds / limits.jerks)
    return np.where(speeds < limits.accelerations * bends, slow, speeds * (speeds / limits.accelerations + bends) / 2)
