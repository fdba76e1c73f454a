"""Primitives for tests of the planner: splines fitted by plain least squares, without smoothing."""

import numpy as np

from motion import splines
from motion.primitive import Primitive

TIMES = np.linspace(0, 1, 1001)
"""Sample times, s, of a demonstration of one second."""


def figure_strike(t: np.ndarray) -> np.ndarray:
    """Return the demonstration of the paper's one-joint figures, rad: d(t) = 2t² + cos(4πt)(1−t) − 1."""
    return 2 * t**2 + np.cos(4 * np.pi * t) * (1 - t) - 1


def fitted(times: np.ndarray, positions: np.ndarray, basis_count: int = 50) -> Primitive:
    """Return the primitive nearest to samples (n, J), rad, at `times` (n,), s from 0."""
    rows = splines.rows(basis_count + 2, splines.POSITION_DEGREE, times / times[-1])
    return of_control_points(float(times[-1]), np.linalg.lstsq(rows, positions, rcond=None)[0].T, len(times))


def of_control_points(duration: float, control_points: np.ndarray, samples: int = 1001) -> Primitive:
    """Return the primitive with these control points (J, N + 2), rad."""
    zero, spread = np.zeros(len(control_points)), np.empty((len(control_points), 0))
    return Primitive(duration, np.ascontiguousarray(control_points), samples, zero, zero, zero, zero, None, spread)


def joint_of(primitive: Primitive, joint: int) -> Primitive:
    """Return one joint of a primitive as a primitive."""
    return of_control_points(primitive.duration, primitive.control_points[joint : joint + 1], primitive.samples)
