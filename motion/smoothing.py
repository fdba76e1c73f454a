"""Fit a spline to a demonstration: penalised least squares on the samples at their own times, without resampling."""

from dataclasses import dataclass

import numpy as np

from motion import splines
from motion.roughness import EVIDENCE, FLOOR, Smoother, condense

MIN_BASIS, MAX_BASIS = 20, 400

LADDER = (20, 26, 35, 50, 70, 100, 140, 200, 280, 400)
"""Numbers of functions to try."""

DENSITY, ENOUGH = 50.0, 50
"""Functions a second that give the limits enough freedom to shape a motion, and the number of functions from which only
the content of the demonstration counts."""

ORDERS = 2, 3, 4, 5, 6
"""Orders of the penalised derivative: 2 suits a joint at rest, 6 does not distort a minimum-jerk motion."""

COMPARISON_ORDER = 4
"""Order of the penalty with which numbers of functions are compared."""

PLACE_SHARE, PLACE_FLOOR, ACCELERATION_SHARE = 1e-3, 1e-4, 3e-2
"""Fewer functions suffice if they change positions by less than this part of the range (or by less than this, rad), and
accelerations by less than this part of their rms."""

FREE = 1e-26
"""Penalty weight of a fit without smoothing, in units of the largest squared singular value."""

INTERPOLATES = 1e-6
"""A spline passes through the samples if its distance from them is below this part of the range."""

GRID = np.linspace(0, 1, 2001)


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Splines of J joints over s in [0, 1].

    control_points: (J, N + 2), rad. noise: (J,), rad, standard deviation. acceleration_error: (J,), rad, standard error
    of d″(s), rms over s.
    """

    control_points: np.ndarray
    noise: np.ndarray
    acceleration_error: np.ndarray

    @property
    def basis_count(self) -> int:
        """Number N of functions of the acceleration."""
        return self.control_points.shape[1] - 2


def fit(s: np.ndarray, positions: np.ndarray, duration: float, basis_count: int | None = None) -> Fit:
    """Fit splines to positions (m, J), rad, at increasing s (m,) from 0 to 1.

    Each joint has its own penalty: its weight maximises the restricted likelihood, its order the likelihood. The number
    of functions is `basis_count`, or the smallest on LADDER that loses nothing against the largest.
    """
    correlations = [run_length(column) for column in positions.T]
    if basis_count is None:
        basis_count = choose_count(s, positions, duration, correlations)
    rows = condense(s, positions, basis_count + 2)
    smoothers = [Smoother(rows, order) for order in ORDERS]
    chosen = []
    for joint, correlation in enumerate(correlations):
        choices = [smoother.choose(joint, correlation) for smoother in smoothers]
        best = min(range(len(ORDERS)), key=lambda i: choices[i][2])
        weight, variance, _ = choices[best]
        scale = np.sqrt(variance * correlation)
        error = scale * smoothers[best].acceleration_error(weight)
        chosen.append((smoothers[best].control_points(joint, weight), np.sqrt(variance), error))
    points, noise, errors = (np.array(column) for column in zip(*chosen, strict=True))
    return Fit(points, noise, errors)


def interpolate(s: np.ndarray, positions: np.ndarray, duration: float, basis_count: int | None = None) -> Fit:
    """Fit without smoothing.

    The fit uses the fewest functions that pass through the samples, or the most that the samples determine.
    """
    near = np.maximum(INTERPOLATES * np.ptp(positions, axis=0), FLOOR)
    *coarser, finest = [basis_count] if basis_count else _ladder(len(s), duration)
    for count in coarser:
        found = _unpenalised(s, positions, count)
        if np.all(np.abs(splines.derivative(found.control_points, s, 0) - positions).max(axis=0) < near):
            return found
    return _unpenalised(s, positions, finest)


def _unpenalised(s: np.ndarray, positions: np.ndarray, count: int) -> Fit:
    smoother = Smoother(condense(s, positions, count + 2), COMPARISON_ORDER)
    weight = FREE * smoother.singular[0] ** 2
    points = np.array([smoother.control_points(joint, weight) for joint in range(positions.shape[1])])
    noise = np.sqrt(smoother.unexplained / max(len(s) - count - 2, 1))
    return Fit(points, noise, noise * smoother.acceleration_error(weight))


def choose_count(s: np.ndarray, positions: np.ndarray, duration: float, correlations: list[float]) -> int:
    """The smallest number of functions on LADDER that loses nothing against the largest the samples allow."""
    ladder = _ladder(len(s), duration)
    finest = _Judged(s, positions, ladder[-1], correlations)
    for count in ladder[:-1]:
        if finest.needs_no_more_than(_Judged(s, positions, count, correlations)):
            return count
    return ladder[-1]


def _ladder(samples: int, duration: float) -> list[int]:
    """The numbers on LADDER from the fewest that limits need to the most that the samples determine."""
    least = float(np.clip(DENSITY * duration, MIN_BASIS, ENOUGH))
    most = max(samples - 2, MIN_BASIS)
    ladder = [count for count in LADDER if count <= most]
    return [count for count in ladder if count >= min(least, ladder[-1])] or ladder[-1:]


def run_length(values: np.ndarray) -> float:
    """Mean number of consecutive equal samples: samples on one step of a quantised encoder share one error."""
    return len(values) / (1 + np.count_nonzero(np.diff(values)))


class _Judged:
    """Fits with one number of functions and one order of penalty, for comparison with others."""

    def __init__(self, s: np.ndarray, positions: np.ndarray, count: int, correlations: list[float]) -> None:
        smoother = Smoother(condense(s, positions, count + 2), COMPARISON_ORDER)
        chosen = [smoother.choose(joint, correlation) for joint, correlation in enumerate(correlations)]
        points = np.array([smoother.control_points(joint, weight) for joint, (weight, _, _) in enumerate(chosen)])
        self.likelihoods = np.array([likelihood for _, _, likelihood in chosen])
        self.positions, self.accelerations = (splines.derivative(points, GRID, order) for order in (0, 2))

    def needs_no_more_than(self, coarser: "_Judged") -> bool:
        """Whether the fits of `coarser` are as good, or good enough, for every joint."""
        as_likely = coarser.likelihoods - self.likelihoods < EVIDENCE
        apart = np.abs(coarser.positions - self.positions).max(axis=0)
        bent = np.sqrt(np.mean((coarser.accelerations - self.accelerations) ** 2, axis=0))
        near = apart < np.maximum(PLACE_SHARE * np.ptp(self.positions, axis=0), PLACE_FLOOR)
        alike = bent < ACCELERATION_SHARE * np.sqrt(np.mean(self.accelerations**2, axis=0))
        return bool(np.all(as_likely | (near & alike)))
