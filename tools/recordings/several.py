"""Several recordings of one movement: align their phases, and compute their mean and spread."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import least_squares

from motion.demonstration import Demonstration
from motion.primitive import learn
from tools.recordings.recording import Recording, Unreadable

Curve = Callable[[np.ndarray], np.ndarray]
"""Positions (n, J), rad, at phases (n,) from 0 to 1."""

KNOTS = 8
"""Intervals of a warp of phase."""

GRID = 100
"""Phases at which recordings are compared."""

ROUNDS = 3
"""Number of rounds of aligning to the mean and taking the mean again."""

STIFF = 0.02
"""Weight of a warp's unevenness, in units of the movement's ranges."""

STILL = 0.2
"""Fraction of the largest range below which a joint is ignored, so that its noise does not affect the alignment."""

FLOOR = 0.01
"""Smallest spread, as a fraction of a joint's range."""

SAMPLES = 2000
"""Largest number of samples of the mean."""


@dataclass(frozen=True, slots=True, eq=False)
class Several:
    """K recordings of one movement, and their mean.

    Attributes:
        mean: The mean movement, in the mean duration.
        spread: (n, J) rad, standard deviation of the recordings around each sample of the mean.
        warps: (K, GRID) phase of each recording at even phases of the mean.
    """

    mean: Recording
    spread: np.ndarray
    warps: np.ndarray

    def weighting(self) -> np.ndarray:
        """Return the spread (GRID, J), rad, at even phases, as `learn` takes it.

        A hundredth of a joint's range is added, because the spread may be 0 at the ends, and small elsewhere by chance.
        """
        every, even = np.linspace(0, 1, len(self.spread)), np.linspace(0, 1, GRID)
        spread = np.stack([np.interp(even, every, column) for column in self.spread.T], axis=1)
        floor = FLOOR * np.ptp(self.mean.values, axis=0)
        return np.hypot(spread, np.maximum(floor, FLOOR * floor.max()))

    def sentence(self) -> str:
        """Describe the spread of the recordings, and its largest value."""
        row, joint = np.unravel_index(int(self.spread.argmax()), self.spread.shape)
        at = self.mean.times[row] - self.mean.times[0]
        typical = float(np.sqrt(np.mean(self.spread**2)))
        return (
            f"{len(self.warps)} recordings are learned together: they spread by {typical:.2g} rad (standard deviation) "
            f"around their mean, most at {at:.3g} s: {self.mean.columns[joint]} by {self.spread[row, joint]:.2g} rad"
        )


def combine(recordings: Sequence[Recording]) -> Several:
    """Align examined recordings of one movement in phase, and return their mean.

    Raises:
        Unreadable: they are not of the same joints, or do not show one movement.
    """
    first = recordings[0]
    for other in recordings[1:]:
        if other.columns != first.columns:
            raise Unreadable(f"{other.source} has other joints than {first.source}; learn them one by one")
    primitives = [learn(Demonstration(recording.times, recording.values)) for recording in recordings]
    curves = [primitive.positions for primitive in primitives]
    warps = align(curves)
    duration = float(np.mean([primitive.duration for primitive in primitives]))
    count = min(max(len(recording.times) for recording in recordings), SAMPLES)
    s = np.linspace(0, 1, count)
    shown = np.stack([
        curve(np.interp(s, np.linspace(0, 1, GRID), warp)) for curve, warp in zip(curves, warps, strict=True)
    ])  # fmt: skip
    mean = replace(first, times=duration * s, values=shown.mean(axis=0))
    return Several(mean, shown.std(axis=0, ddof=1), warps)


def align(curves: Sequence[Curve]) -> np.ndarray:
    """Return the warps (K, GRID) of the phases of K curves that bring the curves nearest to their mean.

    The mean of the warps is even. A curve returns positions (n, J), rad, at phases (n,) from 0 to 1.
    """
    s = np.linspace(0, 1, GRID)
    warps = np.tile(s, (len(curves), 1))
    logits = np.zeros((len(curves), KNOTS))
    for _ in range(ROUNDS):
        shown = np.stack([curve(warp) for curve, warp in zip(curves, warps, strict=True)])
        mean = shown.mean(axis=0)
        spans = np.maximum(np.ptp(mean, axis=0), STILL * np.ptp(mean, axis=0).max())
        logits = np.stack([_fit(curve, mean, spans, guess) for curve, guess in zip(curves, logits, strict=True)])
        warps = np.stack([_warp(row) for row in logits])
        even = warps.mean(axis=0)
        warps = np.stack([np.interp(s, even, warp) for warp in warps])
    return warps


def _fit(curve: Curve, mean: np.ndarray, spans: np.ndarray, guess: np.ndarray) -> np.ndarray:
    """Return the logits (KNOTS,) of the warp that brings a curve nearest to the mean."""

    def residuals(logits: np.ndarray) -> np.ndarray:
        distance = (curve(_warp(logits)) - mean) / spans / np.sqrt(mean.size)
        return np.concatenate([distance.ravel(), STIFF * logits])

    return least_squares(residuals, guess, max_nfev=10).x


def _warp(logits: np.ndarray) -> np.ndarray:
    """Return phases (GRID,) that rise from 0 to 1, with increments between even knots in the ratios exp(logits)."""
    increments = np.exp(logits - logits.max())
    places = np.concatenate([[0.0], np.cumsum(increments) / increments.sum()])
    curve = PchipInterpolator(np.linspace(0, 1, len(places)), places)
    return np.clip(curve(np.linspace(0, 1, GRID)), 0.0, 1.0)
