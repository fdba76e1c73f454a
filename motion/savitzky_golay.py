"""The paper's smoothing: a Savitzky-Golay filter on uniform samples, and the spline that follows its result."""

import numpy as np
import scipy  # scipy loads submodules on first use, so a planner without filters starts sooner

from motion import splines
from motion.demonstration import Demonstration, SavitzkyGolay
from motion.errors import InvalidMotion
from motion.splines import ACCELERATION_DEGREE, POSITION_DEGREE

CLOSEST = 1e-3
"""Least distance of two samples, as a part of the mean distance: interpolation between closer ones overflows."""

PLACE_TIME = 0.1
"""s: the spline follows the filter's accelerations at shorter times, and its positions at longer ones, where errors of
acceleration would accumulate."""


def filtered(demonstration: Demonstration, smoothing: SavitzkyGolay) -> tuple[SavitzkyGolay, np.ndarray, np.ndarray]:
    """The filter as used, and filtered positions (n, J), rad, and accelerations (n, J), rad/s², at uniform times.

    Raises:
        InvalidMotion: the window holds too few samples for the order, or is longer than the demonstration.
    """
    positions = _uniform(demonstration)
    step = demonstration.duration / (len(positions) - 1)
    window = _checked_window(smoothing, step, len(positions))
    places, accelerations = (
        np.asarray(scipy.signal.savgol_filter(positions, window, smoothing.order, deriv=n, delta=step, axis=0))
        for n in (0, 2)
    )
    return SavitzkyGolay(float(window * step), smoothing.order), places, accelerations


def follow(positions: np.ndarray, accelerations: np.ndarray, duration: float, basis_count: int) -> np.ndarray:
    """Control points (J, N + 2), rad, of the spline nearest to uniform positions and accelerations (n, J).

    It minimises Σ(d″ − T²a)² + κ⁴Σ(d − p)² with κ = T/PLACE_TIME.
    """
    count, s = basis_count + 2, np.linspace(0, 1, len(positions))
    second = splines.differentiation(count - 1, POSITION_DEGREE - 1) @ splines.differentiation(count, POSITION_DEGREE)
    place = splines.design(count, POSITION_DEGREE, s)
    acceleration = splines.design(basis_count, ACCELERATION_DEGREE, s)
    weight = (duration / PLACE_TIME) ** 4
    gram = weight * (place.T @ place).toarray() + second.T @ ((acceleration.T @ acceleration) @ second)
    right = weight * (place.T @ positions) + second.T @ (acceleration.T @ (duration**2 * accelerations))
    gram[np.diag_indices(count)] *= 1 + 1e-12  # regular also with fewer samples than control points
    return np.ascontiguousarray(scipy.linalg.solve(gram, right, assume_a="pos").T)


def _uniform(demonstration: Demonstration) -> np.ndarray:
    """The same number of positions, interpolated on a uniform grid."""
    times = demonstration.times - demonstration.times[0]
    uniform = np.linspace(0, times[-1], len(times))
    if np.abs(times - uniform).max() < 1e-6 * uniform[1]:
        return demonstration.positions
    gaps = np.diff(times)
    if gaps.min() < CLOSEST * uniform[1]:
        row = int(gaps.argmin())
        raise InvalidMotion("times", f"samples {row} and {row + 1} are {gaps[row]:.3g} s apart, too close for a filter")
    return scipy.interpolate.make_interp_spline(times, demonstration.positions, k=3)(uniform)


def _checked_window(smoothing: SavitzkyGolay, step: float, count: int) -> int:
    """Odd number of samples in the window. Raises InvalidMotion if the window does not fit."""
    if not (np.isfinite(smoothing.window_s) and smoothing.window_s > 0):
        raise InvalidMotion("smoothing.window_s", f"is {smoothing.window_s}; it must be greater than 0 s")
    if smoothing.order < 2:
        raise InvalidMotion("smoothing.order", f"is {smoothing.order}; accelerations need at least 2")
    window = round(min(smoothing.window_s / step, 1e9)) | 1
    said = f"is {smoothing.window_s:.6g} s"
    if window > count:
        whole = step * (count - 1)
        raise InvalidMotion("smoothing.window_s", f"{said}, longer than the demonstration of {whole:.6g} s")
    if window <= smoothing.order:
        few, least = f"holds {window} samples, too few for order {smoothing.order}", (smoothing.order + 2) * step
        raise InvalidMotion("smoothing.window_s", f"{said} and {few}; {least:.6g} s or more works")
    return window
