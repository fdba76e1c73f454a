"""Statistics of samples: noise, resolution, and errors of interpolation from neighbours."""

import numpy as np

from tools.recordings.recording import Recording

PREDICTION_NOISE = np.sqrt(1 + 34 / 36)
"""Standard deviation of interpolation errors for white noise of 1: the cubic's weights are −1/6, 4/6, 4/6 and −1/6."""

MEDIAN_OF_NORMAL = 0.6745
"""Median absolute value of the standard normal distribution."""

COUNTED, OFF, NEARLY_ALL, ROUNDING = 1000, 0.05, 0.95, 1e-14
"""A column is quantised if this fraction of the differences between its values are multiples of the smallest, to this
relative precision. Larger multiples are not counted; differences below this fraction of the largest value are
rounding."""

LEAST_NOISE = 1e-6
"""Differences below this are rounding, rad."""


def interpolation_errors(times: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the distance (n, C) of each sample from the cubic through two neighbours on either side.

    It is 0 for the first two and the last two samples. times: (n,), rising. values: (n, C).
    """
    errors = np.zeros_like(values)
    if len(times) < 5:
        return errors
    count = len(times) - 4
    at = times[2:-2]
    nodes = [times[k : k + count] for k in (0, 1, 3, 4)]
    expected = np.zeros((count, values.shape[1]))
    for i, shift in enumerate((0, 1, 3, 4)):
        weight = np.ones(count)
        for j, node in enumerate(nodes):
            if j != i:
                weight *= (at - node) / (nodes[i] - node)
        expected += weight[:, None] * values[shift : shift + count]
    errors[2:-2] = values[2:-2] - expected
    return errors


def noise(times: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the standard deviation (C,) of a sample's noise; 0 if the sample-to-sample differences are not noise."""
    errors = interpolation_errors(times, values)[2:-2]
    if len(errors) < 3:
        return np.zeros(values.shape[1])
    size = np.median(np.abs(errors), axis=0) / MEDIAN_OF_NORMAL / PREDICTION_NOISE
    # For noise, adjacent errors have opposite signs; for curvature, the same sign.
    alternating = np.sum(errors[1:] * errors[:-1], axis=0) < 0
    return np.where(alternating & (size > LEAST_NOISE), size, 0.0)


def resolution(values: np.ndarray) -> np.ndarray:
    """Return the resolution (C,) of quantised columns, for example of an encoder; 0 for all others."""
    return np.array([_smallest_step(column) for column in values.T])


def _smallest_step(column: np.ndarray) -> float:
    """Return the number whose multiples are almost all differences between a column's values, or 0."""
    rounding = ROUNDING * float(np.abs(column).max(initial=0.0))
    gaps = np.diff(np.unique(column))
    gaps = gaps[gaps > 10 * rounding]
    if not len(gaps):
        return 0.0
    multiples = gaps / gaps.min()
    remainders = np.abs(multiples - np.round(multiples))[multiples < COUNTED]
    quantised = np.mean(remainders < OFF) > NEARLY_ALL and len(remainders) > len(gaps) / 2
    return float(gaps.min()) if quantised else 0.0


def noise_floor(recording: Recording) -> np.ndarray:
    """Return the noise floor (C,) of each column: the larger of its noise and its resolution."""
    return np.maximum(noise(recording.times, recording.values), resolution(recording.values))


def usual_step(times: np.ndarray) -> float:
    """Return the usual time between two samples, s."""
    return float(np.median(np.diff(times)))


def adjacent_runs(rows: np.ndarray) -> list[tuple[int, int]]:
    """Return the first and last of each run of adjacent indices. rows: sorted."""
    if not len(rows):
        return []
    breaks = np.flatnonzero(np.diff(rows) > 1)
    first = rows[np.concatenate([[0], breaks + 1])]
    last = rows[np.concatenate([breaks, [len(rows) - 1]])]
    return list(zip(first.tolist(), last.tolist(), strict=True))


def counted(count: int, thing: str) -> str:
    """Return `1 sample`, `2 samples`."""
    return f"{count} {thing}" + ("" if count == 1 else "s")
