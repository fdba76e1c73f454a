"""A movement primitive: a demonstration as a spline in normalised time."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motion import splines
from motion.demonstration import Demonstration, SavitzkyGolay, Smoothing
from motion.errors import InvalidMotion
from motion.request import Boundary
from motion.savitzky_golay import filtered, follow
from motion.smoothing import MAX_BASIS, MIN_BASIS, fit, interpolate
from motion.trajectory import Samples

MAX_PHASES = 1001
"""Maximum number of phases at which a spread is given."""


@dataclass(frozen=True, eq=False)
class Primitive:
    """A demonstration d of J joints in normalised time s = t/duration: everything that the planner imitates.

    duration: T_d, s. control_points: (J, N + 2), rad, of d(s), a B-spline of degree 5 on clamped uniform knots; its
    acceleration d″(s) is a cubic B-spline with N functions. samples: number of recorded samples. position_rms,
    position_max: (J,), rad, distance between d and the samples. fit_rms: (J,), rad/s², standard error of the
    acceleration d″/T_d²; with an explicit filter, the rms difference between the filter's acceleration and the
    spline's. noise_estimate: (J,), rad, standard deviation of one sample. smoothing: the requested filter, None for the
    penalised spline. spread: (J, P), rad, standard deviation of several recordings around d at P evenly spaced phases,
    from which the weights of positions follow; P = 0 without weights. Raises InvalidMotion for too few or too many
    functions, a spread of wrong shape, a duration or spread that is not positive, and numbers that are not finite.
    """

    duration: float
    control_points: np.ndarray
    samples: int
    position_rms: np.ndarray
    position_max: np.ndarray
    fit_rms: np.ndarray
    noise_estimate: np.ndarray
    smoothing: SavitzkyGolay | None
    spread: np.ndarray

    def __post_init__(self) -> None:
        _check_basis_count(self.basis_count)
        if not 0 < self.duration < np.inf:
            raise InvalidMotion("duration", f"is {self.duration}; it must be finite and greater than 0 s")
        if not np.isfinite(self.control_points).all():
            raise InvalidMotion("control_points", "must be finite")
        joints, shape = self.joint_count, self.spread.shape
        if self.spread.ndim != 2 or shape[0] != joints or shape[1] == 1 or shape[1] > MAX_PHASES:
            sentence = f"has shape {shape}; it must have a row for each of {joints} joints, of 2 to {MAX_PHASES}"
            raise InvalidMotion("spread", f"{sentence} numbers, one at each phase")
        if not np.all((self.spread > 0) & (self.spread < np.inf)):
            raise InvalidMotion("spread", "must be finite and greater than 0 rad")

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
        return splines.differentiated(self.control_points, 2)

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
        return splines.derivative(self.control_points, s, 0)

    def sample(self, s: np.ndarray) -> Samples:
        """States at s (n,) in [0, 1], played in the demonstration's own duration."""
        return Samples(*(splines.derivative(self.control_points, s, n) / self.duration**n for n in range(3)))

    def check_joints(self, count: int) -> None:
        """Raise InvalidMotion unless the primitive has `count` joints, as the request does."""
        if self.joint_count != count:
            sentence = f"moves {self.joint_count} joints, the request {count}; both must agree"
            raise InvalidMotion("primitive", sentence)

    def _end(self, index: int) -> Boundary:
        ends = (splines.differentiated(self.control_points, n)[:, index] for n in range(3))
        return Boundary(*(end / self.duration**n for n, end in enumerate(ends)))


def learn(
    demonstration: Demonstration,
    smoothing: Smoothing = "auto",
    basis_count: int | None = None,
    spread: np.ndarray | None = None,
) -> Primitive:
    """Learn a primitive from one demonstration.

    "auto" fits a penalised spline to the samples at their own times; "none" follows the samples as closely as the
    spline can; a SavitzkyGolay filters the samples before the spline is fitted. The data determine the number of
    functions unless `basis_count` is given. spread (J, P): see Primitive.

    Raises:
        InvalidMotion: a filter that does not fit the samples, a `basis_count` outside MIN_BASIS to MAX_BASIS, or a
            spread that is not positive for each joint at 2 to MAX_PHASES phases.
    """
    if basis_count is not None:
        _check_basis_count(basis_count)
    s, positions, duration = demonstration.phases, demonstration.positions, demonstration.duration
    used, fitter = None, interpolate if smoothing == "none" else fit
    fitted = fitter(s, positions, duration, basis_count)
    points, fit_rms = fitted.control_points, fitted.acceleration_error / duration**2
    if isinstance(smoothing, SavitzkyGolay):
        used, places, accelerations = filtered(demonstration, smoothing)
        points = follow(places, accelerations, duration, fitted.basis_count)
        followed = splines.derivative(points, np.linspace(0, 1, len(places)), 2) / duration**2
        fit_rms = np.sqrt(np.mean((followed - accelerations) ** 2, axis=0))
    beside = splines.derivative(points, s, 0) - positions
    return Primitive(
        duration=duration,
        control_points=points,
        samples=len(positions),
        position_rms=np.sqrt(np.mean(beside**2, axis=0)),
        position_max=np.abs(beside).max(axis=0),
        fit_rms=fit_rms,
        noise_estimate=fitted.noise,
        smoothing=used,
        spread=np.empty((positions.shape[1], 0)) if spread is None else spread,
    )


def _check_basis_count(count: int) -> None:
    if not MIN_BASIS <= count <= MAX_BASIS:
        raise InvalidMotion("basis_count", f"is {count}; it must be from {MIN_BASIS} to {MAX_BASIS}")
