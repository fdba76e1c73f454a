"""Spline space: motions of one joint in normalised time, the metric of the cost, and the control points of a motion.

The acceleration g″(s) is a cubic B-spline with N functions and weights w. Position, velocity, acceleration and jerk lie
in the convex hulls of their control points, which are linear in w and in the start's position and velocity.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.sparse import block_diag, csr_array

from motion import splines
from motion.program.cache import cached_within

MAX_ROWS = 20_000
"""Maximum number of control points of a hull, for memory."""

PLACE_TIME = 0.5
"""s; where limits force a deviation, the motion returns to the demonstrated positions within about this time."""

QUANTITIES = 4
"""Position, velocity, acceleration and jerk, of degree 5, 4, 3 and 2."""


@dataclass(frozen=True, slots=True, eq=False)
class Space:
    """N functions with a metric.

    The cost of the difference δ of two motions with the same start is ∫δ″² + κ⁴∫δ² ds = |Lᵀδw|², so it is a distance in
    the whitened weights z = Lᵀw. With weights ω(s) of positions it is ∫δ″² + κ⁴∫ωδ² ds. A motion is x = (z, p₀, v₀), N
    + 2 numbers, with the start's position and velocity (with respect to s).

    count: N. stiffness: κ. factor, whitening: L and L⁻¹ (N, N). control_points (4N + 2, N + 2): rows on x of the
    control points of position (N + 2), velocity (N + 1), acceleration (N) and jerk (N − 1), in this order. drift (2,
    N): change of z for a unit deviation of the start (in position, in velocity) from the demonstrated start, if
    positions are part of the cost.
    """

    count: int
    stiffness: float
    factor: np.ndarray
    whitening: np.ndarray
    control_points: np.ndarray
    drift: np.ndarray

    def whitened(self, weights: np.ndarray) -> np.ndarray:
        """Whitened weights z (n, N) of weights w (n, N)."""
        return weights @ self.factor

    def weights(self, z: np.ndarray) -> np.ndarray:
        """Weights w (n, N) of whitened weights z (n, N)."""
        return z @ self.whitening

    def steps_from(self, other: "Space") -> np.ndarray:
        """Matrix (N, N) from steps of z in the metric of another space to steps of z in this one."""
        return self.factor.T @ other.whitening.T

    def rows_at(self, quantity: int, s: np.ndarray) -> np.ndarray:
        """Rows (n, N + 2) on x of the quantity-th derivative of the position at s (n,), from 0 to 3."""
        count = self.count + 2 - quantity
        begin = sum(range(count + 1, self.count + 3))  # control points of the quantities before
        return splines.rows(count, splines.POSITION_DEGREE - quantity, s) @ self.control_points[begin : begin + count]

    def positions(self, x: np.ndarray) -> np.ndarray:
        """Control points (n, N + 2) of the positions of motions x (n, N + 2)."""
        return x @ self.control_points[: self.count + 2].T


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """Control points of the four quantities on finer knots, R in all, for a tighter convex hull.

    points (4N + 2, N + 2), insertion (R, 4N + 2): the space's control points, and the sparse matrix from them to the
    hull's. rows (R, N + 2): on x, their product. quantity (R,): 0 to 3, increasing. s (R,): where each control point
    acts most. ceases (R,): the s at which its support ends. last_acceleration: index of the acceleration at s = 1.
    """

    points: np.ndarray
    insertion: csr_array
    rows: np.ndarray
    quantity: np.ndarray
    s: np.ndarray
    ceases: np.ndarray
    last_acceleration: int


@cached_within(64_000_000)
def make_space(count: int, stiffness: float, weights: tuple[float, ...] = (1.0, 1.0)) -> Space:
    """The space of `count` ≥ 5 functions with κ = `stiffness` and `weights` of positions at evenly spaced s."""
    velocity = splines.integration(count, 3)
    position = splines.integration(count + 1, 4) @ velocity
    at, step = splines.quadrature(count - 3)
    weight = stiffness**4 * step * np.interp(at, np.linspace(0, 1, len(weights)), weights)
    values = splines.design(count + 2, splines.POSITION_DEGREE, at)
    on_positions = values.T @ values.multiply(weight[:, None])  # sparse, as the next products are large without it
    gram = splines.gram(count, splines.ACCELERATION_DEGREE) + position.T @ (on_positions @ position)
    factor = cholesky(gram, lower=True)
    whitening = solve_triangular(factor, np.eye(count), lower=True)
    on_weights = np.concatenate([position, velocity, np.eye(count), splines.differentiation(count, 3)])
    on_start = np.zeros((len(on_weights), 2))
    on_start[: count + 2, 0], on_start[: count + 2, 1] = 1, splines.greville(count + 2, 5)
    on_start[count + 2 : 2 * count + 3, 1] = 1
    rows = np.concatenate([on_weights @ whitening.T, on_start], axis=1)
    drift = -((np.stack([weight, weight * at]) @ values) @ position) @ whitening.T
    return Space(count, stiffness, factor, whitening, rows, drift)


@cached_within(128_000_000)
def make_hull(space: Space, refinement: int, touched: tuple[float, ...] = ()) -> Hull:
    """The hull of a space's motions with `refinement` knot intervals for each one.

    touched: places in s at which a value lies on its limit; there the curve itself becomes a control point.
    """
    insertion, quantity, s, ceases = _insertion(space.count, refinement, touched)
    rows = np.asfortranarray(insertion @ space.control_points)  # makes products with few motions twice as fast
    return Hull(space.control_points, insertion, rows, quantity, s, ceases, int(np.searchsorted(quantity, 3)) - 1)


@lru_cache(maxsize=32)
def _insertion(
    count: int, refinement: int, touched: tuple[float, ...]
) -> tuple[csr_array, np.ndarray, np.ndarray, np.ndarray]:
    """Matrix (R, 4N + 2) from the control points of `count` functions to a hull's, and the hull's other fields."""
    matrices, places, ends = [], [], []
    for degree in range(5, 5 - QUANTITIES, -1):
        own = splines.knots(count - 3 + degree, degree)[degree:-degree]
        inner = np.linspace(0, 1, (count - 3) * refinement + 1)
        inner[::refinement] = own  # exact, so that rounding does not duplicate a knot
        finer = np.sort(np.concatenate([np.zeros(degree), inner, np.repeat(touched, degree), np.ones(degree)]))
        matrices.append(splines.insertion(count - 3 + degree, degree, finer))
        places.append(splines.averages(finer, degree))
        ends.append(finer[degree + 1 :])
    quantity = np.repeat(np.arange(QUANTITIES), [len(each) for each in places])
    return csr_array(block_diag(matrices)), quantity, np.concatenate(places), np.concatenate(ends)
