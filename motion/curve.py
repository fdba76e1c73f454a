"""A motion between the samples of the grid, from its derivatives there."""

import numpy as np

from motion.basis import INTERVALS


def interpolate(curves: np.ndarray, duration: float, times: np.ndarray) -> np.ndarray:
    """Position, velocity and acceleration (3, n, J) at `times` (n,) in [0, duration] s.

    `curves` (J, ≥ 5, M) holds the position and its derivatives on the grid. Each quantity is the quintic through its
    values, slopes and curvatures at both ends of the interval, off by at most h⁶/46080 of its sixth derivative:
    for 50 basis functions 10⁻¹⁰ of the acceleration, less of the others; at the samples themselves by nothing.
    """
    place = times * (INTERVALS / duration)
    left = np.minimum(place.astype(int), INTERVALS - 1)
    x, h = place - left, duration / INTERVALS
    y = 1 - x
    ends = (np.take(curves[:, :5], at, axis=2) for at in (left, left + 1))
    out = np.zeros((len(curves), 3, len(times)))
    for f, near, far, sign in zip(ends, (x, y), (y, x), (1.0, -1.0), strict=True):
        cube = far**3
        out += (cube * (1 + near * (3 + 6 * near))) * f[:, 0:3]
        out += (sign * h * cube * near * (1 + 3 * near)) * f[:, 1:4]
        out += (h * h / 2 * cube * near * near) * f[:, 2:5]
    return out.transpose(1, 2, 0)
