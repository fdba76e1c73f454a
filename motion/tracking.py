"""The tracking law of the 1 kHz loop, eq. 11."""

import numpy as np


def tracking_acceleration(
    alpha: float,
    reference: tuple[np.ndarray, np.ndarray, np.ndarray],
    positions: np.ndarray,
    velocities: np.ndarray,
    out: np.ndarray | None = None,
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
