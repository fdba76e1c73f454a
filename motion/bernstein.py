"""Exact bounds of polynomials.

In Bernstein form a polynomial lies in the convex hull of its coefficients. The first and last coefficients are its
values at the ends of the interval. If the hull exceeds a bound and the values at the ends do not, the interval is
halved: the hulls of the halves are closer to the curve.
"""

from math import comb
from typing import NamedTuple

import numpy as np

HALVINGS = 32
"""Maximum number of halvings; after them the hull differs from the curve by rounding only."""

AT_ONCE = 4096
"""Number of polynomials in one numpy call, so that no call takes long."""


class Outside(NamedTuple):
    """A point of a polynomial that exceeds a bound: index, place in the interval (0 to 1), value."""

    curve: int
    at: float
    value: float


def derivative(coefficients: np.ndarray) -> np.ndarray:
    """Coefficients (…, n − 1) of the derivative of polynomials with coefficients (…, n) of the powers 0 to n − 1."""
    return coefficients[..., 1:] * np.arange(1.0, coefficients.shape[-1])


def bernstein(coefficients: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Bernstein coefficients (…, n) of polynomials on [begin, end].

    coefficients: (…, n), of the powers 0 to n − 1. begin, end: shapes that broadcast to (…).
    """
    count = coefficients.shape[-1]
    if np.any(begin):
        coefficients = np.array(coefficients, dtype=float)
        for last in range(count - 1):  # repeated Horner scheme: coefficients of the time since `begin`
            for power in range(count - 2, last - 1, -1):
                coefficients[..., power] += begin * coefficients[..., power + 1]
    return (coefficients * (end - begin)[..., None] ** np.arange(count)) @ _TO_BERNSTEIN[count]


def first_outside(curves: np.ndarray, low: np.ndarray, high: np.ndarray) -> Outside | None:
    """Find a point of polynomials in Bernstein form that exceeds its bounds; None if all lie inside.

    curves: (N, n). low, high: (N,), ±inf for no bound. A curve that is not finite counts as outside.
    """
    for first in range(0, len(curves), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        found = _first_outside(curves[part], low[part, None], high[part, None])
        if found is not None:
            return found._replace(curve=first + found.curve)
    return None


def _first_outside(curves: np.ndarray, low: np.ndarray, high: np.ndarray) -> Outside | None:
    finite = np.isfinite(curves)
    if not finite.all():
        row, place = np.argwhere(~finite)[0]
        return Outside(int(row), place / max(curves.shape[1] - 1, 1), float(curves[row, place]))
    index, begin = np.arange(len(curves)), np.zeros(len(curves))
    left, right = _HALVES[curves.shape[1]]
    for halving in range(HALVINGS):
        inside = (curves >= low) & (curves <= high)
        if inside.all():
            return None
        outside = np.argwhere(~inside[:, [0, -1]])
        if len(outside):
            row, side = outside[0]
            return Outside(int(index[row]), float(begin[row] + side * 0.5**halving), float(curves[row, -side]))
        wide = ~inside.all(axis=1)
        curves = np.concatenate([curves[wide] @ left, curves[wide] @ right])
        low, high = np.concatenate([low[wide]] * 2), np.concatenate([high[wide]] * 2)
        index = np.concatenate([index[wide]] * 2)
        begin = np.concatenate([begin[wide], begin[wide] + 0.5 ** (halving + 1)])
    return None


def _to_bernstein(count: int) -> np.ndarray:
    """Matrix from the coefficients of powers of the normalised time (rows) to Bernstein coefficients (columns)."""
    degree = count - 1
    return np.array([[comb(i, k) / comb(degree, k) for i in range(count)] for k in range(count)])


def _halves(count: int) -> tuple[np.ndarray, np.ndarray]:
    """De Casteljau's scheme at one half: matrices from the coefficients of an interval to those of its two halves."""
    left = np.array([[comb(i, k) / 2.0**i for i in range(count)] for k in range(count)])
    return left, left[::-1, ::-1]


_COUNTS = range(1, 7)
_TO_BERNSTEIN = {count: _to_bernstein(count) for count in _COUNTS}
_HALVES = {count: _halves(count) for count in _COUNTS}
