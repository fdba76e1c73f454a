"""Clamped uniform B-splines over [0, 1]: rows, integrals, derivatives, knot insertion.

A curve of `count` functions of a degree has `count` control points; the curve lies in their convex hull. Its integral
and its derivative are B-splines on the same knots, one degree up with one control point more and one degree down with
one less. In this project accelerations are cubic: velocities have degree 4, positions 5, jerks 2.
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
    """The same values, sparse: of each row the degree + 1 functions that are not zero."""
    return BSpline.design_matrix(np.asarray(s, dtype=float), knots(count, degree), degree)


@cache
def gram(count: int, degree: int) -> np.ndarray:
    """Integrals (count, count) over [0, 1] of the products of two functions, exact."""
    nodes, weights = np.polynomial.legendre.leggauss(degree + 1)
    width = 1 / (count - degree)
    at = (np.arange(count - degree)[:, None] + (nodes + 1) / 2) * width
    values = rows(count, degree, at.ravel())
    return _constant(values.T @ (values * np.tile(weights * width / 2, count - degree)[:, None]))


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
    """Control points (J, n − order) of that derivative of position splines with control points (J, n)."""
    for degree in range(POSITION_DEGREE, POSITION_DEGREE - order, -1):
        points = points @ differentiation(points.shape[1], degree).T
    return points


def derivative(points: np.ndarray, s: np.ndarray, order: int) -> np.ndarray:
    """Values (n, J) at s (n,) of that derivative with respect to s of position splines (J, count)."""
    points = differentiated(points, order)
    return design(points.shape[1], POSITION_DEGREE - order, s) @ points.T


@cache
def greville(count: int, degree: int) -> np.ndarray:
    """Greville abscissae (count,): the control points of s ↦ s, and where in s a control point acts most."""
    t = knots(count, degree)
    return _constant(np.array([t[i + 1 : i + degree + 1].mean() for i in range(count)]))


@cache
def refinement(count: int, degree: int, factor: int) -> np.ndarray:
    """Matrix (m, count): control points of the same curve with `factor` knot intervals in place of each.

    The finer curve interpolates the coarser one at its Greville abscissae, which determines it.
    """
    finer = (count - degree) * factor + degree
    at = greville(finer, degree)
    return _constant(np.linalg.solve(rows(finer, degree, at), rows(count, degree, at)))


def _constant(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array
