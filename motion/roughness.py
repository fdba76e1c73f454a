"""Penalised least squares of one spline for all penalty weights at once, in closed form.

Eilers and Marx, Flexible smoothing with B-splines and penalties (1996), in the mixed-model form of Wood, Generalized
Additive Models (2017), section 6.2. A position spline of n control points is split into a polynomial, which has no
penalty, and the rest, in coordinates γ in which the penalty is |γ|². A singular value decomposition of the data rows in
γ then gives fit, likelihood and standard error for every penalty weight. Nothing is squared before the decomposition,
so the weight may range over 32 decades.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from motion import splines
from motion.splines import POSITION_DEGREE

WEIGHTS = np.geomspace(1e-28, 1e4, 129)
"""Penalty weights to try, in units of the largest squared singular value."""

EVIDENCE = 15.0
"""Improvement of −2·log likelihood that is required to prefer anything over a polynomial, or more functions over fewer.
It is a likelihood ratio of 1800, which noise reaches in one of thousands of recordings."""

FLOOR = 1e-9
"""rad: rounding of recorded numbers; smaller differences are ignored."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Least squares of n control points, condensed: minimise |matrix·c − values|² + residual.

    matrix: (n, n), upper triangular and banded. values: (n, J), rad. residual: (J,), rad², the part that no control
    points can fit. count: number of samples.
    """

    matrix: np.ndarray
    values: np.ndarray
    residual: np.ndarray
    count: int


def condense(s: np.ndarray, positions: np.ndarray, count: int) -> Rows:
    """Condensed rows of `count` control points for positions (m, J) at rising s (m,) in [0, 1], by QR.

    The samples of one knot interval after the other are triangularised together with the rows left from the intervals
    before. This keeps the matrix banded, because a sample depends on neighbouring control points only.
    """
    order = POSITION_DEGREE + 1
    rows = splines.design(count, POSITION_DEGREE, s)
    design, interval = rows.data.reshape(-1, order), rows.indices.reshape(-1, order)[:, 0]
    samples = np.concatenate([design, positions], axis=1)
    matrix, values = np.zeros((count, count)), np.zeros((count, positions.shape[1]))
    residual = np.zeros(positions.shape[1])
    for first, begin, length in zip(*np.unique(interval, return_index=True, return_counts=True), strict=True):
        here = slice(first, first + order)
        left = np.concatenate([matrix[here, here], values[here]], axis=1)
        r = np.asarray(np.linalg.qr(np.concatenate([left, samples[begin : begin + length]]), mode="r"))
        matrix[here, here], values[here] = r[:order, :order], r[:order, order:]
        residual += (r[order:, order:] ** 2).sum(axis=0)
    return Rows(matrix, values, residual, len(s))


class Smoother:
    """Penalised fits of `rows` for all weights, with a penalty on the square integral of the `order`-th derivative.

    Order 6, one more than the degree, penalises the jumps of the fifth derivative at the knots.
    """

    def __init__(self, rows: Rows, order: int) -> None:
        """Decompose `rows` for a penalty on the derivative of this order, 2 to 6."""
        self.order, self.rows = order, rows
        self.polynomials, self.rough = _coordinates(rows.matrix.shape[1], order)
        q, self.r = np.linalg.qr(rows.matrix @ self.polynomials)
        self.q, matrix, values = q, rows.matrix @ self.rough, rows.values
        for _ in range(2):  # two passes suffice (Kahan and Parlett)
            matrix, values = matrix - q @ (q.T @ matrix), values - q @ (q.T @ values)
        left, self.singular, self.right = np.linalg.svd(matrix, full_matrices=False)
        self.components = left.T @ values
        self.unexplained = rows.residual + ((values - left @ self.components) ** 2).sum(axis=0)

    def choose(self, joint: int, correlation: float = 1.0) -> tuple[float, float, float]:
        """Penalty weight, variance of the noise (rad²), and −2·log likelihood of one joint.

        The weight maximises the restricted likelihood (REML). The largest weight, which leaves a polynomial, is
        preferred unless another is better by EVIDENCE. The likelihood, with EVIDENCE and Schwarz's penalty (BIC) for
        the polynomial's coefficients, compares orders and numbers of functions. `correlation` neighbouring samples with
        equal errors count as one sample.
        """
        count, power = self.rows.count / correlation, self.singular**2 / correlation
        weights = WEIGHTS[:, None] * power[0]
        shrinkage = weights / (power + weights)
        squares = self.unexplained[joint] + shrinkage @ self.components[:, joint] ** 2
        squares = squares / correlation + count * FLOOR**2
        free = max(count - self.order, 1.0)
        volume = np.log1p(power / weights).sum(axis=1)
        best = int((free * np.log(squares) + volume).argmin())
        likelihoods = count * np.log(squares / count) + volume + self.order * np.log(max(count, 2.0))
        likelihoods[:-1] += EVIDENCE
        if likelihoods[-1] < likelihoods[best]:
            best = len(likelihoods) - 1
        return float(weights[best, 0] * correlation), float(squares[best] / free), float(likelihoods[best])

    def control_points(self, joint: int, weight: float) -> np.ndarray:
        """Control points (n,) of the fit of one joint."""
        gamma = self.right.T @ (self.singular / (self.singular**2 + weight) * self.components[:, joint])
        rest = self.rows.values[:, joint] - self.rows.matrix @ (self.rough @ gamma)
        return self.polynomials @ np.linalg.solve(self.r, self.q.T @ rest) + self.rough @ gamma

    def acceleration_error(self, weight: float) -> float:
        """Standard error of d″(s), rms over s, in units of the noise's standard deviation."""
        back = np.linalg.inv(self.r)
        known = self.rough - self.polynomials @ (back @ (self.q.T @ (self.rows.matrix @ self.rough)))
        spread = (known @ self.right.T) / np.sqrt(self.singular**2 + weight)
        curvature = _curvature(self.rows.matrix.shape[1])
        return float(np.linalg.norm(np.concatenate([curvature @ spread, curvature @ self.polynomials @ back], axis=1)))


@cache
def _coordinates(count: int, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Control points (count, order) of polynomials, and (count, count − order) of the rest, scaled to unit penalty."""
    at = splines.greville(count, POSITION_DEGREE)
    legendre = np.polynomial.legendre.legvander(2 * at - 1, order - 1)
    polynomials = np.linalg.solve(splines.rows(count, POSITION_DEGREE, at), legendre)
    degree = POSITION_DEGREE - order
    if degree >= 0:
        factor = cholesky(splines.gram(count - order, degree), lower=True)
        rough = solve_triangular(factor, np.eye(count - order), lower=True).T
    else:  # the fifth derivative is piecewise constant: penalise its jumps
        steps = np.tril(np.ones((count - POSITION_DEGREE, count - order)), -1)
        rough, degree = steps / np.sqrt(count - POSITION_DEGREE), 0
    while degree < POSITION_DEGREE:
        rough, degree = splines.integration(len(rough), degree) @ rough, degree + 1
    return polynomials, rough


@cache
def _curvature(count: int) -> np.ndarray:
    """Matrix (count − 2, count): |matrix·c|² is the square integral of the second derivative."""
    factor = cholesky(splines.gram(count - 2, POSITION_DEGREE - 2), lower=True)
    first = splines.differentiation(count, POSITION_DEGREE)
    return factor.T @ splines.differentiation(count - 1, POSITION_DEGREE - 1) @ first
