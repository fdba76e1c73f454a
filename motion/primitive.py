"""A movement primitive: a demonstration as a spline in normalised time."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motion import splines
from motion.demonstration import SavitzkyGolay
from motion.request import Boundary
from motion.trajectory import Samples

MIN_BASIS, MAX_BASIS = 20, 400


@dataclass(frozen=True, eq=False)
class Primitive:
    """A demonstration d of J joints in normalised time s = t/duration: all that the planner needs to imitate it.

    duration: T_d, s. control_points: (J, N + 2), rad, of d(s), a B-spline of degree 5 on clamped uniform knots, so that
    its acceleration d″(s) is a cubic one with N functions. samples: how many were recorded. position_rms, position_max:
    (J,), rad, distance between d and the samples. fit_rms: (J,), rad/s², how well the acceleration is known.
    noise_estimate: (J,), rad. smoothing: the filter that was asked for, None for the penalised spline.
    """

    duration: float
    control_points: np.ndarray
    samples: int
    position_rms: np.ndarray
    position_max: np.ndarray
    fit_rms: np.ndarray
    noise_estimate: np.ndarray
    smoothing: SavitzkyGolay | None

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return len(self.control_points)

    @property
    def basis_count(self) -> int:
        """Number N of functions of the acceleration."""
        return self.control_points.shape[1] - 2

    @cached_property
    def weights(self) -> np.ndarray:
        """Control points (J, N) of d″(s), rad."""
        return self._derivative(2)

    @cached_property
    def start(self) -> Boundary:
        """State at s = 0."""
        return self._end(0)

    @cached_property
    def goal(self) -> Boundary:
        """State at s = 1."""
        return self._end(-1)

    def positions(self, s: np.ndarray) -> np.ndarray:
        """Positions (n, J), rad, at s (n,) in [0, 1]."""
        return self._values(s, 0)

    def sample(self, s: np.ndarray) -> Samples:
        """States at s (n,) in [0, 1], played in the demonstration's own duration."""
        return Samples(*(self._values(s, order) / self.duration**order for order in range(3)))

    def _derivative(self, order: int) -> np.ndarray:
        """Control points of the derivative of this order with respect to s."""
        points, degree = self.control_points, splines.POSITION_DEGREE
        for _ in range(order):
            points, degree = points @ splines.differentiation(points.shape[1], degree).T, degree - 1
        return points

    def _values(self, s: np.ndarray, order: int) -> np.ndarray:
        points = self._derivative(order)
        return splines.rows(points.shape[1], splines.POSITION_DEGREE - order, s) @ points.T

    def _end(self, index: int) -> Boundary:
        return Boundary(*(self._derivative(order)[:, index] / self.duration**order for order in range(3)))
