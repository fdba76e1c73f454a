"""The Gaussian basis of eq. 8 in normalised time, its integrals, derivatives and Gram matrix (design 1.1, 1.2).

Order −2 is the double integral from 0 (position), −1 the integral (velocity), 0 the function (acceleration),
1 its derivative (jerk), and so on.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import hermite_e
from scipy.linalg import cholesky, solve_triangular
from scipy.special import erf

INTERVALS = 1000
"""Intervals of the grid on which limits are looked at."""

WIDTH = 0.7
"""Standard deviation in units of the spacing: fits a strike to 0.6 %, condition number of the Gram matrix 62."""


@dataclass(frozen=True, slots=True, eq=False)
class Basis:
    """N Gaussians with centres equally spaced over [0, 1], ends included."""

    centres: np.ndarray
    sigma: float

    def rows(self, s: np.ndarray, order: int) -> np.ndarray:
        """Values (n, N) at s (n,) of the derivative of the given order (≥ −2) of all basis functions."""
        x = (np.asarray(s, dtype=float)[:, None] - self.centres) / self.sigma
        if order >= 0:
            return _hermite_gaussian(x, order) / self.sigma**order
        # ∫ψ = σ√(π/2) erf(x/√2), once more with ∫erf(y)dy = y erf(y) + exp(−y²)/√π, both from s = 0.
        y, y0 = x / np.sqrt(2), -self.centres / (self.sigma * np.sqrt(2))
        factor = self.sigma * np.sqrt(np.pi / 2)
        if order == -1:
            return factor * (erf(y) - erf(y0))
        twice = np.sqrt(2) * self.sigma * (_integral_of_erf(y) - _integral_of_erf(y0))
        return factor * (twice - np.asarray(s)[:, None] * erf(y0))

    def gram(self) -> np.ndarray:
        """Ψ_ij = ∫ψ_iψ_j over [0, 1] (eq. 13): (N, N)."""
        middle = (self.centres[:, None] + self.centres) / 2
        apart = self.centres[:, None] - self.centres
        window = erf((1 - middle) / self.sigma) + erf(middle / self.sigma)
        return np.exp(-((apart / (2 * self.sigma)) ** 2)) * self.sigma * np.sqrt(np.pi) / 2 * window

    def peak(self, order: int) -> float:
        """The largest |ψ⁽ⁿ⁾(s)| of any basis function over all s, for order n ≥ 0."""
        turning = hermite_e.hermeroots([0] * (order + 1) + [1])
        return float(np.abs(_hermite_gaussian(turning, order)).max() / self.sigma**order)


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """A basis on the grid s (M,) = 0, 1/intervals, … 1, in the coordinates in which motions are planned.

    A motion of one joint in normalised time is x = (z, p0, v0), N + 2 numbers: with Ψ = LLᵀ the whitened weights
    z = Lᵀw, in which the cost of eq. 12 is |z − z_d|² + const, z_d = L⁻¹θ; and the start's position and velocity.
    Everything about it is linear in x. `unit_curves` (N+2, 6, M): position and its first five derivatives of each
    coordinate alone, `norms` (4,) the largest norm on z among the rows of each limited quantity; `whitening` is L⁻¹.
    The fourth derivatives of position, velocity, acceleration and jerk are the orders 2 … 5: `spread` (4, M−1, N)
    bounds |ψ⁽ⁿ⁾| of each function on each interval, `peaks` (4,) anywhere.
    """

    basis: Basis
    s: np.ndarray
    whitening: np.ndarray
    unit_curves: np.ndarray
    norms: np.ndarray
    spread: np.ndarray
    peaks: np.ndarray

    @property
    def intervals(self) -> int:
        """M − 1."""
        return len(self.s) - 1

    def curves(self, x: np.ndarray) -> np.ndarray:
        """Position and its first five derivatives with respect to s (n, 6, M) of the motions x (n, N+2)."""
        return (x @ self.unit_curves.reshape(len(self.unit_curves), -1)).reshape(len(x), 6, -1)

    def rows(self, flat: np.ndarray) -> np.ndarray:
        """Rows (n, N+2) on x of the samples `flat` (n,) = quantity·M + sample."""
        return self.unit_curves.reshape(len(self.unit_curves), -1)[:, flat].T

    def row_at(self, quantity: int, s: float) -> np.ndarray:
        """Row (N+2,) on x of position, velocity or acceleration at any s."""
        index = round(s * self.intervals)
        if index == s * self.intervals:
            return self.unit_curves[:, quantity, index]
        weights = (self.basis.rows(np.array([s]), quantity - 2) @ self.whitening.T)[0]
        return np.concatenate([weights, [(1.0, 0.0, 0.0)[quantity], (s, 1.0, 0.0)[quantity]]])

    def whiten(self, theta: np.ndarray) -> np.ndarray:
        """z = L⁻¹θ for rows θ (J, N)."""
        return theta @ self.whitening.T

    def weights(self, x: np.ndarray) -> np.ndarray:
        """w = L⁻ᵀz (n, N) of the motions x (n, N+2)."""
        return x[:, :-2] @ self.whitening


@cache
def make_basis(count: int) -> Basis:
    """The basis of `count` ≥ 5 functions."""
    centres = np.linspace(0, 1, count)
    return Basis(centres, WIDTH / (count - 1))


@cache
def make_grid(count: int, intervals: int = INTERVALS) -> Grid:
    """The grid of the basis of `count` functions, built once."""
    basis = make_basis(count)
    s = np.linspace(0, 1, intervals + 1)
    factor = cholesky(basis.gram(), lower=True)
    # The factor's condition number is 8, so its inverse loses nothing.
    whitening = solve_triangular(factor, np.eye(count), lower=True)
    unit_curves = np.zeros((count + 2, 6, len(s)))
    for k in range(6):
        unit_curves[:-2, k] = (basis.rows(s, k - 2) @ whitening.T).T
    unit_curves[-2:, 0] = np.ones_like(s), s
    unit_curves[-1, 1] = 1.0
    orders = range(2, 6)
    # |f| between two points ≤ the larger end + h²/8·max|f″|.
    ends = [np.abs(basis.rows(s, order)) for order in orders]
    spread = [
        np.maximum(e[:-1], e[1:]) + s[1] ** 2 / 8 * basis.peak(order + 2) for e, order in zip(ends, orders, strict=True)
    ]
    peaks = np.array([basis.peak(order) for order in orders])
    norms = np.linalg.norm(unit_curves[:-2, :4], axis=0).max(axis=1)
    return Grid(basis, s, whitening, unit_curves, norms, np.stack(spread), peaks)


def _hermite_gaussian(x: np.ndarray, order: int) -> np.ndarray:
    """The derivative of the given order of exp(−x²/2): (−1)ⁿ Heₙ(x) exp(−x²/2)."""
    return (-1) ** order * hermite_e.hermeval(x, [0] * order + [1]) * np.exp(-x * x / 2)


def _integral_of_erf(y: np.ndarray) -> np.ndarray:
    return y * erf(y) + np.exp(-y * y) / np.sqrt(np.pi)
