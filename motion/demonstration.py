"""A recorded movement and its smoothing."""

from dataclasses import dataclass
from math import comb
from typing import Literal

import numpy as np
import scipy

from motion.errors import InvalidMotion

MIN_SAMPLES = 10
AUTO_ORDER = 5
LONGEST_AUTO = 1001
"""Samples of the longest window that "auto" tries: filtering takes time in proportion."""
_DIFFERENCE = 6
_RESIDUAL_FLOOR = 1e-6


@dataclass(frozen=True, slots=True)
class SavitzkyGolay:
    """A Savitzky-Golay filter: `window_s` in seconds, polynomial `order` (2 or more)."""

    window_s: float
    order: int


Smoothing = Literal["auto", "none"] | SavitzkyGolay


@dataclass(frozen=True, slots=True, eq=False)
class Demonstration:
    """Recorded joint positions (n, J), rad, at strictly increasing times (n,), s.

    Raises InvalidMotion for wrong shapes, fewer than MIN_SAMPLES samples, non-finite numbers, or times that
    do not increase.
    """

    times: np.ndarray
    positions: np.ndarray

    def __post_init__(self) -> None:
        times, positions = np.asarray(self.times, dtype=float), np.asarray(self.positions, dtype=float)
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "positions", positions)
        if positions.ndim != 2 or positions.shape[1] == 0:
            raise InvalidMotion("positions", f"needs samples × joints; it has shape {positions.shape}")
        if times.shape != (len(positions),):
            raise InvalidMotion("times", f"needs one time a sample, {len(positions)}; it has shape {times.shape}")
        if len(times) < MIN_SAMPLES:
            raise InvalidMotion("positions", f"has {len(times)} samples; at least {MIN_SAMPLES} are needed")
        if not np.isfinite(positions).all():
            row, joint = np.argwhere(~np.isfinite(positions))[0]
            raise InvalidMotion("positions", f"is not finite at sample {row}, joint {joint}")
        if not (np.isfinite(times).all() and np.all(np.diff(times) > 0)):
            raise InvalidMotion("times", "have to be finite and to increase from sample to sample")


@dataclass(frozen=True, slots=True, eq=False)
class SmoothDemonstration:
    """Positions, velocities, accelerations (n, J) on the uniform grid `times` (n,), which starts at 0.

    `noise_estimate` (J,) is the rms of the recording's noise, rad; `smoothing` the filter used, None for none.
    """

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray
    noise_estimate: np.ndarray
    smoothing: SavitzkyGolay | None


def smooth(demonstration: Demonstration, smoothing: Smoothing = "auto") -> SmoothDemonstration:
    """Resample uniformly where needed and differentiate.

    "auto" takes the longest window whose residual is still explained by the noise, the same for all joints;
    "none" differentiates a quintic spline through the samples. Raises InvalidMotion for a window that does
    not hold more samples than the order or is longer than the demonstration.
    """
    times, positions = _uniform(demonstration)
    step = times[1]
    noise = estimate_noise(positions)
    if smoothing == "none":
        spline = scipy.interpolate.make_interp_spline(times, positions, k=5)
        return SmoothDemonstration(times, spline(times), spline(times, 1), spline(times, 2), noise, None)
    if smoothing == "auto":
        window, order = _auto_window(positions, noise), AUTO_ORDER
    else:
        window, order = _checked_window(smoothing, step, len(times)), smoothing.order
    smoothed, velocities, accelerations = (
        np.asarray(scipy.signal.savgol_filter(positions, window, order, deriv=n, delta=step, axis=0)) for n in range(3)
    )
    used = SavitzkyGolay(float(window * step), order)
    return SmoothDemonstration(times, smoothed, velocities, accelerations, noise, used)


def estimate_noise(positions: np.ndarray) -> np.ndarray:
    """Rms (J,) of white noise on uniform samples (n, J): from differences of order 6, which a smooth
    movement hardly has, by their median so that single outliers do not count."""
    differences = np.abs(np.diff(positions, n=_DIFFERENCE, axis=0))
    return np.median(differences, axis=0) / 0.6745 / np.sqrt(comb(2 * _DIFFERENCE, _DIFFERENCE))


def _uniform(demonstration: Demonstration) -> tuple[np.ndarray, np.ndarray]:
    """Times from 0 and positions on a uniform grid of as many samples."""
    times = demonstration.times - demonstration.times[0]
    uniform = np.linspace(0, times[-1], len(times))
    if np.abs(times - uniform).max() < 1e-6 * uniform[1]:
        return uniform, demonstration.positions
    return uniform, scipy.interpolate.make_interp_spline(times, demonstration.positions, k=3)(uniform)


def _auto_window(positions: np.ndarray, noise: np.ndarray) -> int:
    """The longest odd window (samples) whose residual stays within the noise (discrepancy principle)."""
    shortest = AUTO_ORDER + 2
    longest = max(shortest, min(LONGEST_AUTO, int(0.3 * len(positions))))
    best = shortest
    for window in np.unique(np.geomspace(shortest, longest, 25).astype(int) | 1):
        if window > len(positions):
            break
        residual = positions - scipy.signal.savgol_filter(positions, window, AUTO_ORDER, axis=0)
        if np.any(np.sqrt(np.mean(residual**2, axis=0)) > 1.05 * noise + _RESIDUAL_FLOOR):
            break
        best = int(window)
    # At the longest window the residual allows, the second derivative is already bent: keep well below it.
    return max(shortest, int(0.7 * best) | 1)


def _checked_window(smoothing: SavitzkyGolay, step: float, count: int) -> int:
    """The window in samples, odd. Raises InvalidMotion where it does not fit."""
    if not (np.isfinite(smoothing.window_s) and smoothing.window_s > 0):
        raise InvalidMotion("smoothing.window_s", f"is {smoothing.window_s}; it has to be greater than 0 s")
    if smoothing.order < 2:
        raise InvalidMotion("smoothing.order", f"is {smoothing.order}; accelerations need at least 2")
    window = round(min(smoothing.window_s / step, 1e9)) | 1
    if window > count:
        raise InvalidMotion(
            "smoothing.window_s",
            f"of {smoothing.window_s:.6g} s is longer than the demonstration of {step * (count - 1):.6g} s",
        )
    if window <= smoothing.order:
        raise InvalidMotion(
            "smoothing.window_s",
            f"of {smoothing.window_s:.6g} s holds {window} samples, too few for order {smoothing.order}; "
            f"{(smoothing.order + 2) * step:.6g} s or more works",
        )
    return window
