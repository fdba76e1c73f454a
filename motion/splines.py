"""Clamped uniform B-splines over [0, 1]: rows, integrals, derivatives, knot insertion.

A curve of `count` functions has `count` control points and lies in their convex hull. Its integral is a B-spline on the
same knots, with one degree and one control point more; its derivative has one of each less. In this project
accelerations are cubic: velocities have degree 4, positions 5, jerks 2.
"""

from functools import cache

import numpy as np
from scipy.interpolate import BSpline
from scipy.sparse import csr_array

ACCELERATION_DEGREE = 3
POSITION_DEGREE = 5


@cache
def knots(count: int, degree: int) -> np.ndarray:
    """Knots (count + degree + 1,) of `count` functions: uniform, with the ends repeated degree + 1 times."""
    return _constant(np.concatenate([np.zeros(degree), np.linspace(0, 1, count - degree + 1), np.ones(degree)]))


def rows(count: int, degree: int, s: np.ndarray) -> np.ndarray:
    """Values (n, count) of all functions at s (n,) in [0, 1]."""
    return design(count, degree, s).toarray()


def design(count: int, degree: int, s: np.ndarray) -> csr_array:
    """The same values, sparse: each row holds the degree + 1 functions that are not zero."""
    return BSpline.design_matrix(np.asarray(s, dtype=float), knots(count, degree), degree)


@cache
def gram(count: int, degree: int) -> np.ndarray:
    """Exact integrals (count, count) over [0, 1] of the products of two functions."""
    at, weights = quadrature(count - degree, degree + 1)
    values = rows(count, degree, at)
    return _constant(values.T @ (values * weights[:, None]))


@cache
def quadrature(intervals: int, nodes: int = POSITION_DEGREE + 1) -> tuple[np.ndarray, np.ndarray]:
    """Gauss nodes (K,) of all knot intervals, increasing, and weights (K,), exact for products of two positions."""
    at, weights = np.polynomial.legendre.leggauss(nodes)
    width = 1 / intervals
    s = ((np.arange(intervals)[:, None] + (at + 1) / 2) * width).ravel()
    return _constant(s), _constant(np.tile(weights * width / 2, intervals))


@cache
def integration(count: int, degree: int) -> np.ndarray:
    """Matrix (count + 1, count): control points of the integral from 0."""
    t = knots(count, degree)
    widths = (t[degree + 1 :] - t[:count]) / (degree + 1)
    return _constant(np.vstack([np.zeros(count), np.tril(np.ones((count, count))) * widths]))


@cache
def differentiation(count: int, degree: int) -> np.ndarray:
    """Matrix (count − 1, count): control points of the derivative with respect to s."""
    t = knots(count, degree)
    slopes = degree / (t[degree + 1 : count + degree] - t[1:count])
    matrix = np.zeros((count - 1, count))
    each = np.arange(count - 1)
    matrix[each, each], matrix[each, each + 1] = -slopes, slopes
    return _constant(matrix)


def differentiated(points: np.ndarray, order: int) -> np.ndarray:
    """Control points (J, n − order) of the `order`-th derivative of position splines with control points (J, n)."""
    for degree in range(POSITION_DEGREE, POSITION_DEGREE - order, -1):
        points = points @ differentiation(points.shape[1], degree).T
    return points


def derivative(points: np.ndarray, s: np.ndarray, order: int) -> np.ndarray:
    """Values (n, J) at s (n,) of the `order`-th derivative with respect to s of position splines (J, count)."""
    points = differentiated(points, order)
    return design(points.shape[1], POSITION_DEGREE - order, s) @ points.T


@cache
def greville(count: int, degree: int) -> np.ndarray:
    """Greville abscissae (count,): the control points of s ↦ s. Each is where its control point acts most."""
    return _constant(averages(knots(count, degree), degree))


def averages(t: np.ndarray, degree: int) -> np.ndarray:
    """Greville abscissae (m,) of a knot vector t (m + degree + 1,): averages of `degree` knots."""
    return np.lib.stride_tricks.sliding_window_view(t[1:-1], degree).mean(axis=1)


def insertion(count: int, degree: int, finer: np.ndarray) -> csr_array:
    """Matrix (m, count), sparse: from the control points of a curve to those on `finer` knots (m + degree + 1,).

    `finer` contains the curve's knots. A control point is the blossom of a piece at `degree` consecutive knots
    (Ramshaw), computed by de Boor's recursion from degree + 1 of the curve's control points.
    """
    t = knots(count, degree)
    arguments = np.lib.stride_tricks.sliding_window_view(finer[1:-1], degree)
    # Any piece inside the new function's support gives the same result; take the last one up to its middle.
    last = np.searchsorted(t[: count + 1], finer[: -degree - 1], side="right") - 1
    last = np.clip(last, degree, count - 1)
    first = last - degree
    parts = np.broadcast_to(np.eye(degree + 1), (len(arguments), degree + 1, degree + 1)).copy()
    for step in range(1, degree + 1):
        u = arguments[:, step - 1, None]
        index = first[:, None] + np.arange(step, degree + 1)
        left, right = t[index], t[index + degree + 1 - step]
        share = ((u - left) / (right - left))[:, :, None]
        parts[:, step:] = (1 - share) * parts[:, step - 1 : -1] + share * parts[:, step:]
    sources = first[:, None] + np.arange(degree + 1)
    begins = np.arange(0, sources.size + 1, degree + 1)
    return csr_array((parts[:, -1].ravel(), sources.ravel(), begins), shape=(len(sources), count))


def _constant(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array
