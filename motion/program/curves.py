"""Curves of planned motions at the knots and between them, and their extremes."""

from functools import cache

import numpy as np
from scipy.special import factorial

from motion import splines
from motion.trajectory import COEFFICIENTS, Trajectory

ORDERS = 5
"""Position and its first four derivatives."""

STEPS = 3
"""Number of steps between two knots. The error of `extremes` falls with its sixth power."""


def curves_of(control_points: np.ndarray) -> np.ndarray:
    """Position and its first four derivatives (J, 5, n) of position splines (J, N + 2) at the ends of n − 1 steps.

    There are three steps between two knots. The k-th derivative is multiplied by hᵏ with the step h = 1/(n − 1).
    """
    matrix = _at_steps(control_points.shape[1])
    return (control_points @ matrix).reshape(len(control_points), ORDERS, -1)


def positions_of(control_points: np.ndarray) -> np.ndarray:
    """Positions alone (J, n)."""
    matrix = _at_steps(control_points.shape[1])
    return control_points @ matrix[:, : matrix.shape[1] // ORDERS]


@cache
def _at_steps(count: int) -> np.ndarray:
    """Matrix (count, 5n) from `count` control points of the position to its curves."""
    s = np.linspace(0, 1, STEPS * (count - splines.POSITION_DEGREE) + 1)
    each = [splines.derivative(np.eye(count), s, order) * s[1] ** order for order in range(ORDERS)]
    return np.ascontiguousarray(np.concatenate(each).T)


def curves_along(moving: Trajectory) -> np.ndarray:
    """Return the curves (J, 5, 3m + 1), as `curves_of`, of a motion in m pieces of equal length."""
    times = np.linspace(0, moving.duration, STEPS * len(moving.coefficients) + 1)
    curves = np.transpose(moving.derivatives(times, ORDERS), (2, 0, 1))
    return np.ascontiguousarray(curves * (times[1] ** np.arange(ORDERS))[:, None])


def trajectory_of(curves: np.ndarray, duration: float) -> Trajectory:
    """The motion with `curves` (J, 5, 3m + 1) as polynomials between its m + 1 knots; duration: its own, s."""
    at = curves[:, :, ::STEPS]
    # The fourth derivative is linear between two knots, and continuous at knots.
    orders = np.concatenate([at[..., :-1], np.diff(at[:, 4:]) / STEPS], axis=1).transpose(2, 0, 1)
    step = duration / (curves.shape[2] - 1)
    return Trajectory(
        np.linspace(0.0, duration, at.shape[2]), orders * _TAYLOR / step ** np.arange(float(COEFFICIENTS))
    )


_TAYLOR = 1 / factorial(np.arange(COEFFICIENTS))


def extremes(curves: np.ndarray, duration: float) -> np.ndarray:
    """Lowest and highest position, velocity, acceleration and jerk (J, 4, 2) of curves (J, 5, n).

    duration: of the motion, s. A step is examined if the slope changes its sign in it once, or possibly twice. The
    extremes of the cubic through values and slopes are found, and the curve is evaluated there, so the motion reaches
    every value that is returned. The error grows with the square of the distance between cubic and curve; it is at most
    a millionth of the spread.
    """
    values, rising = curves[:, :4], curves[:, 1:] > 0
    turning = rising[..., 1:] != rising[..., :-1]
    turning[:, :3] |= turning[:, 1:] & (rising[:, :3, :-1] != rising[:, 1:, :-1])
    found = np.empty((2, len(curves), 4))
    values.min(axis=2, out=found[0])
    values.max(axis=2, out=found[1])
    steps = turning.ravel().nonzero()[0]
    if steps.size:
        of, inside = _inside(curves, steps)
        np.minimum.at(found[0].ravel(), of, inside.min(axis=0))
        np.maximum.at(found[1].ravel(), of, inside.max(axis=0))
    return found.transpose(1, 2, 0) * (duration / (curves.shape[2] - 1)) ** -np.arange(4.0)[:, None]


def _inside(curves: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which of 4J curves m steps belong to, and the curves' values (2, m) at the extremes of their cubics."""
    size = curves.shape[2]
    of = steps // (size - 1)
    first, quantity = steps + of + (of >> 2) * size, of & 3
    at = first + np.concatenate([size * _FROM, size * _FROM + 1]).take(quantity, axis=1)
    f0, d0, fourth, f1, d1, fifth = curves.ravel().take(at)
    rise, fifth = f1 - f0, fifth - fourth
    c = d0 + d1 - 2 * rise
    b = rise - d0 - c
    # Roots of the slope d0 + 2b x + 3c x², in the form without cancellation; a linear slope has one root.
    far = -b - np.copysign(np.sqrt(np.maximum(b * b - 3 * c * d0, 0.0)), b)
    x = np.array([d0, far]) / (np.array([far, 3 * c]) + _NONZERO)
    x = np.minimum(np.maximum(x, 0.0), 1.0)
    at_fourth, at_fifth, at_rest = _BUMPS.take(quantity, axis=1)
    bump = (x * (1 - x)) ** 2 * (fourth * at_fourth + fifth * (at_fifth + at_rest * x))
    return of, f0 + x * (d0 + x * (b + x * c)) + bump


_NONZERO = 1e-200
"""Added to a divisor of 0; too small to change any other."""

_FROM = np.array([[0, 0, 0, 0], [1, 1, 1, 1], [4, 3, 2, 1]])
"""Order of the derivative, for each quantity: its own, its slope's, and that of the position's fourth derivative."""

_BUMPS = np.array([[1 / 24, 0.0, 0.0, 0.0], [1 / 60, 1 / 24, 0.0, 0.0], [1 / 120, 0.0, 0.0, 0.0]])
"""Factors of the fourth derivative, of its change over the step, and of that times x. Acceleration and jerk are cubics
in a step. Position and velocity differ from their cubics by x²(1 − x)² times a linear function."""
