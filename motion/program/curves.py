"""Curves of planned motions at the knots and between them, and their extremes."""

from functools import cache

import numpy as np

from motion import splines

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
    return found.transpose(1, 2, 0)


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
