"""Motions in physical time: samples, and piecewise polynomials that are evaluated at any time."""

from dataclasses import dataclass

import numpy as np

COEFFICIENTS = 6
"""Of a piece: degree 5 or less."""

ARRIVED = 1e-10
"""This many seconds before a break the next piece counts: rounding of the times asked for."""


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
    piece began. After the last break the last piece goes on: a motion that ends at rest ends with a constant piece,
    which may have no length.
    """

    breaks: np.ndarray
    coefficients: np.ndarray

    @property
    def duration(self) -> float:
        """Time of the last break, s."""
        return float(self.breaks[-1])

    @property
    def final_positions(self) -> np.ndarray:
        """Positions (J,) at the last break, rad."""
        return self.sample(self.breaks[-1:]).positions[0]

    def sample(self, times: np.ndarray) -> Samples:
        """States at `times` (n,), s from the start."""
        times = np.asarray(times, dtype=float)
        piece = np.maximum(np.searchsorted(self.breaks[:-1], times + ARRIVED, side="right") - 1, 0)
        x, columns = (times - self.breaks[piece])[:, None], np.ascontiguousarray(self.coefficients.transpose(2, 0, 1))
        states = []
        for _ in range(3):
            highest, *lower = columns[::-1]
            values = highest.take(piece, axis=0)
            for column in lower:
                values *= x
                values += column.take(piece, axis=0)
            states.append(values)
            columns = columns[1:] * np.arange(1.0, len(columns))[:, None, None]
        return Samples(*states)

    def then(self, other: "Trajectory") -> "Trajectory":
        """This motion followed by `other`, which begins at this one's last break."""
        return Trajectory(
            np.concatenate([self.breaks, self.breaks[-1] + other.breaks[1:]]),
            np.concatenate([self.coefficients, other.coefficients]),
        )
