"""Motions in physical time: samples, and piecewise polynomials that are evaluated at any time."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

COEFFICIENTS = 6
"""Number of coefficients of a piece: degree 5 or less."""

ARRIVED = 1e-10
"""s; the next piece applies this long before its break, because requested times are rounded."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Positions (rad), velocities (rad/s) and accelerations (rad/s²): (count, J) each."""

    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray

    def __len__(self) -> int:
        return len(self.positions)


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Piecewise polynomials of J joints in m pieces.

    breaks: (m + 1,) s, from 0, not decreasing. coefficients: (m, J, 6), rad/sᵏ of the k-th power of the time since the
    piece began. After the last break the last piece continues. A motion that ends at rest therefore has a constant last
    piece, which may have no length.
    """

    breaks: np.ndarray
    coefficients: np.ndarray

    @property
    def duration(self) -> float:
        """Time of the last break, s."""
        return float(self.breaks[-1])

    def sample(self, times: np.ndarray) -> Samples:
        """States at `times` (n,), s from the start."""
        return Samples(*self.derivatives(times, 3))

    def derivatives(self, times: np.ndarray, count: int) -> list[np.ndarray]:
        """Positions at `times` (n,) and their derivatives, `count` in all: (n, J), rad/sᵏ."""
        times = np.asarray(times, dtype=float)
        piece = np.maximum(np.searchsorted(self.breaks[:-1], times + ARRIVED, side="right") - 1, 0)
        x, columns = (times - self.breaks[piece])[:, None], np.ascontiguousarray(self.coefficients.transpose(2, 0, 1))
        found = []
        for _ in range(count):
            highest, *lower = columns[::-1]
            values = highest.take(piece, axis=0)
            for column in lower:
                values *= x
                values += column.take(piece, axis=0)
            found.append(values)
            columns = columns[1:] * np.arange(1.0, len(columns))[:, None, None]
        return found

    def then(self, other: "Trajectory") -> "Trajectory":
        """This motion followed by `other`, which begins at this one's last break."""
        return Trajectory(
            np.concatenate([self.breaks, self.breaks[-1] + other.breaks[1:]]),
            np.concatenate([self.coefficients, other.coefficients]),
        )


def quintic(begin: Iterable[np.ndarray], end: Iterable[np.ndarray], duration: float) -> np.ndarray:
    """Coefficients (…, 6), of powers of the time, of the polynomial of degree 5 from one state to another.

    begin, end: position, velocity and acceleration (…), rad/sᵏ. duration: s.
    """
    (p0, v0, a0), (p1, v1, a1), h = begin, end, duration
    rise, steep, bent = p1 - p0 - h * (v0 + h * a0 / 2), h * (v1 - v0 - h * a0), h * h * (a1 - a0)
    low = p0, h * v0, h * h * a0 / 2
    high = 10 * rise - 4 * steep + bent / 2, 7 * steep - 15 * rise - bent, 6 * rise - 3 * steep + bent / 2
    return np.stack([*low, *high], axis=-1) / h ** np.arange(float(COEFFICIENTS))
