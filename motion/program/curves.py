"""Curves of planned motions at the knots and between them, and their extremes."""

from functools import cache

import numpy as np

from motion import splines

ORDERS = 5
"""Position and its first four derivatives."""

STEPS = 3
"""In which a piece is divided: what `extremes` misses falls with the sixth power."""

NOTHING = 1e-150
"""A divisor below this belongs to a line or parabola that has its maximum at an end."""


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


def curves_of_pieces(pieces: np.ndarray) -> np.ndarray:
    """Return the same (J, 5, 3m + 1) for m pieces (m, J, 6) of equal length.

    pieces: coefficients of powers of the time since the piece began, in units of its length.
    """
    count, joints, _ = pieces.shape
    values = (pieces.reshape(-1, 6) @ _POWERS).reshape(count, joints, STEPS + 1, ORDERS)
    curves = np.empty((joints, ORDERS, STEPS * count + 1))
    curves[:, :, :-1] = values[:, :, :-1].transpose(1, 3, 0, 2).reshape(joints, ORDERS, -1)
    curves[:, :, -1] = values[-1, :, -1]
    return curves


def _powers() -> np.ndarray:
    """From coefficients to values of all orders at the ends of the steps of a piece (6, 4·5)."""
    matrix = np.zeros((6, STEPS + 1, ORDERS))
    for node in range(STEPS + 1):
        for order in range(ORDERS):
            for power in range(order, 6):
                factor = np.prod(np.arange(power - order + 1, power + 1, dtype=float))
                matrix[power, node, order] = factor * (node / STEPS) ** (power - order) / STEPS**order
    return matrix.reshape(6, -1)


_POWERS = _powers()


def extremes(curves: np.ndarray) -> np.ndarray:
    """Lowest and highest position, velocity, acceleration and jerk (J, 4, 2) of curves (J, 5, n), in their units.

    Between two places the extreme is looked for where the cubic through values and slopes has its own. There the curve
    itself is evaluated, so nothing is named that it does not reach; what is missed grows with the square of the
    distance between cubic and curve: a millionth of the spread at most.
    """
    values, slopes = curves[:, :4], curves[:, 1:]
    f0, d0, d1 = values[..., :-1], slopes[..., :-1], slopes[..., 1:]
    rise = values[..., 1:] - f0
    c = d0 + d1 - 2 * rise
    b = rise - d0 - c
    # The slope d0 + 2b x + 3c x² has two roots, here in the form that does not cancel: a maximum and a minimum.
    root = np.sqrt(np.maximum(b * b - 3 * c * d0, 0.0))
    far = np.where(b > 0, -b - root, root - b)
    above, below = np.array([d0, far]), np.array([far, 3 * c])
    below[np.abs(below) < NOTHING] = 1.0
    x = np.minimum(np.maximum(above / below, 0.0), 1.0)
    at = f0 + x * (d0 + x * (b + x * c))
    # Acceleration and jerk are such cubics; the others differ from theirs by a multiple of x²(1 − x)².
    fourth, fifth = curves[:, 4, :-1], np.diff(curves[:, 4])
    bump = (x[:, :, :2] * (1 - x[:, :, :2])) ** 2
    at[:, :, 0] += bump[:, :, 0] * (fourth / 24 + fifth * (2 + x[:, :, 0]) / 120)
    at[:, :, 1] += bump[:, :, 1] * (fifth / 24)
    lowest = np.minimum(values.min(axis=2), at.min(axis=(0, 3)))
    highest = np.maximum(values.max(axis=2), at.max(axis=(0, 3)))
    return np.stack([lowest, highest], axis=2)
