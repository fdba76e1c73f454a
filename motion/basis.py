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

BLOCK = 77
"""Samples that are evaluated together: thirteen blocks are 1001 samples."""

REACH = 9.5
"""This many σ away a Gaussian and its first three derivatives are 0, its integral constant and its double integral a
line, to 10⁻¹⁶ of their peaks."""


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
    Everything about it is linear in x; `whitening` is L⁻¹. `limited` (4·M, N+2) are the rows on x of the limited
    quantities, sample by sample, `norms` (4,) the largest norm on z among those of each. The fourth derivatives of
    position, velocity, acceleration and jerk are the orders 2 … 5: `spread` (4, M−1, N) bounds |ψ⁽ⁿ⁾| of each function
    on each interval, `peaks` (4,) anywhere.

    On a block of neighbouring samples only the few functions nearby bend the motion; those far to its right add
    nothing, those far to its left a straight line to the position. `near` (N+2, B·(K+2)) leads from x to the K weights
    nearby and the start and slope of that line for each of B blocks, `blocks` (B, K+2, 6·m) from there to position and
    its first five derivatives at the block's m samples.
    """

    basis: Basis
    s: np.ndarray
    whitening: np.ndarray
    limited: np.ndarray
    norms: np.ndarray
    spread: np.ndarray
    peaks: np.ndarray
    near: np.ndarray
    blocks: np.ndarray

    @property
    def intervals(self) -> int:
        """M − 1."""
        return len(self.s) - 1

    def curves(self, x: np.ndarray) -> np.ndarray:
        """Position and its first five derivatives with respect to s (n, 6, M) of the motions x (n, N+2)."""
        count, size, _ = self.blocks.shape
        nearby = (x @ self.near).reshape(len(x), count, size).transpose(1, 0, 2)
        values = (nearby @ self.blocks).reshape(count, len(x), 6, -1)
        return values.transpose(1, 2, 0, 3).reshape(len(x), 6, -1)[:, :, : len(self.s)]

    def row_at(self, quantity: int, s: float) -> np.ndarray:
        """Row (N+2,) on x of position, velocity, acceleration or jerk at any s."""
        return _rows(self.basis, self.whitening, np.array([s]), quantity)[0]

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
    limited = np.concatenate([_rows(basis, whitening, s, quantity) for quantity in range(4)])
    norms = np.linalg.norm(limited[:, :-2], axis=1).reshape(4, -1).max(axis=1)
    orders = range(2, 6)
    # |f| between two points ≤ the larger end + h²/8·max|f″|.
    ends = [np.abs(basis.rows(s, order)) for order in orders]
    spread = [
        np.maximum(e[:-1], e[1:]) + s[1] ** 2 / 8 * basis.peak(order + 2) for e, order in zip(ends, orders, strict=True)
    ]
    peaks = np.array([basis.peak(order) for order in orders])
    near, blocks = _in_blocks(basis, whitening, s)
    return Grid(basis, s, whitening, limited, norms, np.stack(spread), peaks, near, blocks)


def _rows(basis: Basis, whitening: np.ndarray, s: np.ndarray, quantity: int) -> np.ndarray:
    """Rows (n, N+2) on x of one limited quantity at s (n,)."""
    start = [(np.ones_like(s), s), (0 * s, np.ones_like(s)), (0 * s, 0 * s), (0 * s, 0 * s)][quantity]
    return np.concatenate([basis.rows(s, quantity - 2) @ whitening.T, np.stack(start, axis=1)], axis=1)


def _in_blocks(basis: Basis, whitening: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`near` and `blocks` of a grid."""
    reach, size = REACH * basis.sigma, len(basis.centres)
    # The last block goes on beyond s = 1: it is cut off.
    samples = s[1] * np.arange(-(-len(s) // BLOCK) * BLOCK).reshape(-1, BLOCK)
    first = np.searchsorted(basis.centres, samples[:, 0] - reach)
    count = int((np.searchsorted(basis.centres, samples[:, -1] + reach) - first).max())
    first = np.minimum(first, size - count)
    chosen = first[:, None] + np.arange(count)
    # A function that lies behind has become a line; it is read off beyond the reach of all.
    beyond = np.array([1 + 2 * reach])
    slopes = basis.rows(beyond, -1)[0]
    starts = basis.rows(beyond, -2)[0] - beyond * slopes
    passed = np.arange(size)[:, None] < first
    near = np.zeros((size + 2, len(first), count + 2))
    near[:-2, :, :-2] = whitening[:, chosen]
    near[:-2, :, -2], near[:-2, :, -1] = whitening @ (passed * starts[:, None]), whitening @ (passed * slopes[:, None])
    near[-2, :, -2] = near[-1, :, -1] = 1.0
    blocks = np.zeros((len(first), count + 2, 6, BLOCK))
    for order in range(6):
        functions = basis.rows(samples.ravel(), order - 2).reshape(*samples.shape, size)
        blocks[:, :-2, order] = np.take_along_axis(functions, chosen[:, None], axis=2).transpose(0, 2, 1)
    blocks[:, -2, 0] = blocks[:, -1, 1] = 1.0
    blocks[:, -1, 0] = samples
    return near.reshape(size + 2, -1), blocks.reshape(len(first), count + 2, -1)


def _hermite_gaussian(x: np.ndarray, order: int) -> np.ndarray:
    """The derivative of the given order of exp(−x²/2): (−1)ⁿ Heₙ(x) exp(−x²/2)."""
    return (-1) ** order * hermite_e.hermeval(x, [0] * order + [1]) * np.exp(-x * x / 2)


def _integral_of_erf(y: np.ndarray) -> np.ndarray:
    return y * erf(y) + np.exp(-y * y) / np.sqrt(np.pi)
