"""Curves of planned motions at the knots and half way between them, and their extremes."""

from functools import cache

import numpy as np

ORDERS = 5
"""Position and its first four derivatives."""

NOTHING = 1e-150
"""A divisor below this belongs to a line or parabola that has its maximum at an end."""

TRIED, NEWTON_STEPS = 3, 2
"""Along a limit several peaks are nearly as high as the highest, and the cubics do not tell which it is."""


def half_knots(pieces: np.ndarray) -> np.ndarray:
    """Position and its first four derivatives with respect to s (5, J, 2m + 1) at s = 0, 1/2m, 2/2m, … 1.

    pieces (m, J, 6): coefficients of powers of s since each of m equal pieces began.
    """
    count, joints, _ = pieces.shape
    values = (pieces.reshape(-1, 6) @ _powers(count)).reshape(count, joints, 3, ORDERS)
    curves = np.empty((ORDERS, joints, 2 * count + 1))
    curves[:, :, :-1] = values[:, :, :2].transpose(3, 1, 0, 2).reshape(ORDERS, joints, -1)
    curves[:, :, -1] = values[-1, :, 2].T
    return curves


@cache
def _powers(count: int) -> np.ndarray:
    """From coefficients to values of all orders at the begin, the middle and the end of a piece of length 1/count."""
    matrix = np.zeros((6, 3, ORDERS))
    for node, x in enumerate((0.0, 0.5 / count, 1.0 / count)):
        for order in range(ORDERS):
            for power in range(order, 6):
                factor = np.prod(np.arange(power - order + 1, power + 1, dtype=float))
                matrix[power, node, order] = factor * x ** (power - order)
    return matrix.reshape(6, -1)


def extremes(pieces: np.ndarray, curves: np.ndarray) -> np.ndarray:
    """Lowest and highest position, velocity, acceleration and jerk (J, 4, 2) of m pieces and their `half_knots`.

    Between two instants the extreme is looked for where the cubic through values and slopes has its own; from there on
    the curve itself is followed, so nothing is named that it does not reach.
    """
    step = 1 / (curves.shape[2] - 1)
    values, slopes = curves[:4], step * curves[1:5]
    f0, d0, d1 = values[..., :-1], slopes[..., :-1], slopes[..., 1:]
    rise = values[..., 1:] - f0
    b, c = 3 * rise - 2 * d0 - d1, d0 + d1 - 2 * rise
    # The slope d0 + 2b x + 3c x² has two roots, here in the form that does not cancel: a maximum and a minimum.
    root = np.sqrt(np.maximum(b * b - 3 * c * d0, 0.0))
    far = np.where(b > 0, -b - root, root - b)
    above, below = np.stack([d0, far]), np.stack([far, 3 * c])
    below[np.abs(below) < NOTHING] = 1.0
    x = np.minimum(np.maximum(above / below, 0.0), 1.0)
    at = (f0 + x * (d0 + x * (b + x * c))).transpose(1, 2, 0, 3).reshape(*values.shape[:2], -1)
    lowest, highest = np.minimum(values.min(axis=2), at.min(axis=2)), np.maximum(values.max(axis=2), at.max(axis=2))
    # Acceleration and jerk are such cubics themselves.
    found = np.stack([each.argpartition(TRIED, axis=2)[:, :, :TRIED] for each in (at[:2], -at[:2])])
    x = np.take_along_axis(x.transpose(1, 2, 0, 3).reshape(1, *at.shape)[:, :2], found, axis=3)
    low, high = _near(pieces, found % f0.shape[2] // 2, step * (found % f0.shape[2] % 2 + x))
    lowest[:2], highest[:2] = np.minimum(values[:2].min(axis=2), low), np.maximum(values[:2].max(axis=2), high)
    return np.stack([lowest, highest], axis=2).transpose(1, 0, 2)


def _near(pieces: np.ndarray, piece: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest position and velocity (2, J) of a few candidates (2, 2, J, n), the low ones first.

    Each is in a piece of its own: at x since it began, and two Newton steps from there towards where the slope is zero.
    """
    coefficients = pieces[piece, np.arange(pieces.shape[1])[:, None]]
    values = [_evaluated(coefficients, 0, x)]
    for _ in range(NEWTON_STEPS):
        slopes, bends = _evaluated(coefficients, 1, x), _evaluated(coefficients, 2, x)
        bends[np.abs(bends) < NOTHING] = np.inf
        x = np.clip(x - slopes / bends, 0.0, 1 / len(pieces))
        values.append(_evaluated(coefficients, 0, x))
    low, high = np.concatenate(values, axis=3)
    return low.min(axis=2), high.max(axis=2)


def _evaluated(coefficients: np.ndarray, order: int, x: np.ndarray) -> np.ndarray:
    """The order-th derivatives of position and velocity (2, 2, J, n) at x."""
    each = slice(order, order + 2)
    return (coefficients * _FACTORS[each] * x[..., None] ** _POWERS[each]).sum(axis=4)


_POWERS = np.maximum(np.arange(6) - np.arange(4)[:, None], 0)[:, None, None]
_FACTORS = np.array([[1.0] * 6, [0, 1, 2, 3, 4, 5], [0, 0, 2, 6, 12, 20], [0, 0, 0, 6, 24, 60]])[:, None, None]
"""Of the coefficients in position and its first three derivatives: (4, 1, 1, 6)."""
