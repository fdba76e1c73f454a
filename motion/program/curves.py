"""Curves of planned motions at the knots and between them, and their extremes."""

from functools import cache

import numpy as np
from scipy.special import factorial

from motion import splines
from motion.trajectory import COEFFICIENTS, Trajectory

ORDERS = 5
"""Position and its first four derivatives."""

STEPS = 3
"""In which a piece is divided: what `extremes` misses falls with the sixth power."""


def curves_of(control_points: np.ndarray) -> np.ndarray:
    """Position and its first four derivatives (J, 5, n) of position splines (J, N + 2) at the ends of n − 1 steps.

    Three steps lie between two knots. Each derivative comes times a power of the step h = 1/(n − 1), as if h
    were 1.
    """
    matrix = _at_steps(control_points.shape[1])
    return (control_points @ matrix).reshape(len(control_points), ORDERS, -1)


def positions_of(control_points: np.ndarray) -> np.ndarray:
    """Positions alone (J, n)."""
    matrix = _at_steps(control_points.shape[1])
    return control_points @ matrix[:, : matrix.shape[1] // ORDERS]


@cache
def _at_steps(count: int) -> np.ndarray:
    """From `count` control points of the position to their curves (count, 5n)."""
    s = np.linspace(0, 1, STEPS * (count - splines.POSITION_DEGREE) + 1)
    each = [splines.derivative(np.eye(count), s, order) * s[1] ** order for order in range(ORDERS)]
    return np.ascontiguousarray(np.concatenate(each).T)


def curves_along(moving: Trajectory) -> np.ndarray:
    """Return the same (J, 5, 3m + 1) for a motion in m pieces of equal length."""
    times = np.linspace(0, moving.duration, STEPS * len(moving.coefficients) + 1)
    curves = np.transpose(moving.derivatives(times, ORDERS), (2, 0, 1))
    return np.ascontiguousarray(curves * (times[1] ** np.arange(ORDERS))[:, None])


def trajectory_of(curves: np.ndarray, duration: float) -> Trajectory:
    """The motion with `curves` (J, 5, 3m + 1) as polynomials between its m + 1 knots, played in `duration` s."""
    at = curves[:, :, ::STEPS]
    # Between two knots the fourth derivative is a line, and at knots it is continuous.
    orders = np.concatenate([at[..., :-1], np.diff(at[:, 4:]) / STEPS], axis=1).transpose(2, 0, 1)
    step = duration / (curves.shape[2] - 1)
    return Trajectory(
        np.linspace(0.0, duration, at.shape[2]), orders * _TAYLOR / step ** np.arange(float(COEFFICIENTS))
    )


_TAYLOR = 1 / factorial(np.arange(COEFFICIENTS))


def extremes(curves: np.ndarray, duration: float) -> np.ndarray:
    """Lowest and highest position, velocity, acceleration and jerk (J, 4, 2) of curves (J, 5, n), which take some s.

    A step is looked at where the slope changes its sign in it, or may do so twice. There the extremes of the cubic
    through values and slopes are found and the curve itself is evaluated, so nothing is named that it does not reach;
    what is missed grows with the square of the distance between cubic and curve: a millionth of the spread at most.
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
    """Which of 4J curves m steps belong to, and the values (2, m) at the extremes of their cubics, or at an end."""
    size = curves.shape[2]
    of = steps // (size - 1)
    first, quantity = steps + of + (of >> 2) * size, of & 3
    at = first + np.concatenate([size * _FROM, size * _FROM + 1]).take(quantity, axis=1)
    f0, d0, fourth, f1, d1, fifth = curves.ravel().take(at)
    rise, fifth = f1 - f0, fifth - fourth
    c = d0 + d1 - 2 * rise
    b = rise - d0 - c
    # The slope d0 + 2b x + 3c x² has two roots, here in the form that does not cancel; of a line or a parabola one.
    far = -b - np.copysign(np.sqrt(np.maximum(b * b - 3 * c * d0, 0.0)), b)
    x = np.array([d0, far]) / (np.array([far, 3 * c]) + _NONZERO)
    x = np.minimum(np.maximum(x, 0.0), 1.0)
    at_fourth, at_fifth, at_rest = _BUMPS.take(quantity, axis=1)
    bump = (x * (1 - x)) ** 2 * (fourth * at_fourth + fifth * (at_fifth + at_rest * x))
    return of, f0 + x * (d0 + x * (b + x * c)) + bump


_NONZERO = 1e-200
"""Makes a divisor of 0 another number, and nothing else."""

_FROM = np.array([[0, 0, 0, 0], [1, 1, 1, 1], [4, 3, 2, 1]])
"""How many derivatives from each quantity to itself, to its slope and to the fourth derivative of the position."""

_BUMPS = np.array([[1 / 24, 0.0, 0.0, 0.0], [1 / 60, 1 / 24, 0.0, 0.0], [1 / 120, 0.0, 0.0, 0.0]])
"""Acceleration and jerk are cubics in a step; position and velocity differ from theirs by x²(1 − x)² times a constant
and a line: factors of the fourth derivative, of its change over the step, and of that times x."""
