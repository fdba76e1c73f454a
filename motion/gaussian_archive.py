"""Primitives on disk as they were kept while accelerations were sums of Gaussians."""

from collections.abc import Mapping

import numpy as np

from motion import splines
from motion.errors import InvalidMotion
from motion.smoothing import fit

SAMPLES = 1001
"""Of the smoothed positions, uniform from start to end."""


def is_gaussian(arrays: Mapping[str, np.ndarray]) -> bool:
    """Whether `arrays` are of that form."""
    return "theta" in arrays and "control_points" not in arrays


def converted(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The same primitive in today's form: a spline fitted to its smoothed positions (1001, J).

    Raises:
        InvalidMotion: positions or duration are missing or malformed.
    """
    for name in ("positions", "duration"):
        if name not in arrays:
            raise InvalidMotion(name, "is missing")
        if not np.isfinite(arrays[name]).all():
            raise InvalidMotion(name, "must be finite")
    positions, duration = np.asarray(arrays["positions"], dtype=float), np.asarray(arrays["duration"], dtype=float)
    if positions.ndim != 2 or len(positions) != SAMPLES or not positions.size:
        raise InvalidMotion("positions", f"needs {SAMPLES} samples × joints; it has shape {positions.shape}")
    if duration.shape != () or duration <= 0:
        raise InvalidMotion("duration", f"is {duration}; it must be greater than 0 s")
    s = np.linspace(0, 1, SAMPLES)
    fitted = fit(s, positions, float(duration))
    beside = splines.derivative(fitted.control_points, s, 0) - positions
    return {
        **{name: arrays[name] for name in ("duration", "samples", "noise_estimate", "smoothing") if name in arrays},
        "control_points": fitted.control_points,
        "position_rms": np.sqrt(np.mean(beside**2, axis=0)),
        "position_max": np.abs(beside).max(axis=0),
        "fit_rms": fitted.acceleration_error / float(duration) ** 2,
    }
