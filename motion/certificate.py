"""Whether joints keep their limits at every time, not only on the grid (design 1.6)."""

from dataclasses import dataclass

import numpy as np

from motion.basis import INTERVALS, Grid
from motion.problem import TOUCH, Problem

_H = 1 / INTERVALS


@dataclass(frozen=True, slots=True, eq=False)
class Certificate:
    """One joint's limits at all times. `curve` (6, M): position and its first five derivatives on the grid.

    `extremes` (4, 2): lowest and highest value over all t. `failures`: (quantity, s) of each place where the
    limit could not be shown to hold; none of them means certified.
    """

    curve: np.ndarray
    extremes: np.ndarray
    failures: tuple[tuple[int, float], ...]


def certify(grid: Grid, problem: Problem, joints: list[int], z: np.ndarray, values: np.ndarray) -> list[Certificate]:
    """Bound all four quantities of n joints with the weights z (n, N), whose `values` (n, 4, M) are known.

    On an interval |f| stays below the larger end plus h²/8·max|f″|, and max|f″| below its larger end plus
    h²/8·max|f⁗|. Where that does not decide, f is the cubic Hermite polynomial through its ends and slopes
    within h⁴/384·max|f⁗|, and max|f⁗| ≤ Σ|w_i|·max|ψ_i⁽⁴⁾ of f|.
    """
    curves = _with_higher_derivatives(grid, problem, z, values)
    step = problem.duration * _H
    weights, to_step = np.abs(z @ grid.whitening), _H**4 / problem.duration ** np.arange(4.0)
    anywhere = grid.peaks * to_step * weights.sum(axis=1)[:, None]
    limits = (
        (problem.lower, problem.upper)
        if len(z) == len(problem.lower)
        else (problem.lower[joints], problem.upper[joints])
    )
    highest, (side, n, k, i) = _near_the_top(curves, limits, problem.last, anywhere, step)
    # Lower limits are upper ones seen upside down.
    sign = 2.0 * side - 1
    f0, f1 = sign * curves[n, k, i], sign * curves[n, k, i + 1]
    x, top = _hermite_peak(f0, f1, sign * step * curves[n, k + 1, i], sign * step * curves[n, k + 1, i + 1])
    np.maximum.at(highest, (side, n, k), top)
    bend = step**2 * np.maximum(np.abs(curves[n, k + 2, i]), np.abs(curves[n, k + 2, i + 1]))
    bound = np.maximum(f0, f1) + (bend + anywhere[n, k] / 8) / 8
    allowed = _allowed(problem, side, np.asarray(joints)[n], k, i)
    doubtful = np.flatnonzero((bound > allowed) & (top > allowed - anywhere[n, k] / 384))
    failures: list[list[tuple[int, float]]] = [[] for _ in z]
    if doubtful.size:
        places = k[doubtful], i[doubtful]
        fourth = np.einsum("ij,ij->i", grid.spread[places], weights[n[doubtful]]) * to_step[k[doubtful]]
        passed = doubtful[top[doubtful] + fourth / 384 > allowed[doubtful]]
        for m, quantity, s in _highest_of_stretches(n[passed], k[passed], i[passed] + x[passed], top[passed]):
            failures[m].append((quantity, s))
    extremes = np.stack([-highest[0], highest[1]], axis=2)
    return [Certificate(*parts) for parts in zip(curves, extremes, map(tuple, failures), strict=True)]


def _with_higher_derivatives(grid: Grid, problem: Problem, z: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Position and its first five derivatives (n, 6, M) on the grid."""
    curves = np.empty((len(z), 6, values.shape[2]))
    curves[:, :4] = values
    higher = (z @ grid.rows[4:].reshape(-1, z.shape[1]).T).reshape(len(z), 2, -1)
    np.divide(higher, problem.duration ** np.array([[4.0], [5.0]]), out=curves[:, 4:])
    return curves


def _near_the_top(
    curves: np.ndarray, limits: tuple[np.ndarray, np.ndarray], last: int, anywhere: np.ndarray, step: float
) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """The largest samples (2, n, 4), upside down and upright, and (side, curve, quantity, left sample) of all intervals
    on which a curve may rise above them or reach its limit.

    Nowhere does it rise above its samples by more than h²/8·max|f″|, for which one bound a curve is enough.
    """
    moving = curves[:, :, : last + 1]
    largest, smallest = moving.max(axis=2), moving.min(axis=2)
    bulge = (step**2 * np.maximum(largest[:, 2:], -smallest[:, 2:]) + anywhere / 8) / 8
    highest = np.stack([-smallest[:, :4], largest[:, :4]])
    tightest = np.stack([-limits[0][:, :, :last].max(axis=2), limits[1][:, :, :last].min(axis=2)])
    threshold = (np.minimum(highest, tightest) - bulge)[..., None]
    f = moving[:, :4]
    high = np.stack([f <= -threshold[0], f >= threshold[1]])
    side, rest = np.divmod(np.flatnonzero(high[..., :-1] | high[..., 1:]), len(curves) * 4 * last)
    n, rest = np.divmod(rest, 4 * last)
    return highest, (side, n, *np.divmod(rest, last))


def _allowed(problem: Problem, side: np.ndarray, joint: np.ndarray, k: np.ndarray, i: np.ndarray) -> np.ndarray:
    """The limits, lower ones upside down; beside a boundary value that lies on its limit it may be touched."""
    at = joint, k, i
    limit = np.where(side == 1, problem.upper[at], -problem.lower[at])
    band = np.where(side == 1, problem.upper_band[at], problem.lower_band[at])
    slack = 2 * TOUCH * problem.half_range[joint, k]
    return limit + np.where(band < 5 * slack, slack, 0.0)


def _highest_of_stretches(
    n: np.ndarray, quantity: np.ndarray, place: np.ndarray, top: np.ndarray
) -> list[tuple[int, int, float]]:
    """(curve, quantity, s) of the highest place of each stretch of neighbouring intervals."""
    starts = np.flatnonzero((np.diff(place) > 2) | (np.diff(place) < 0) | (np.diff(4 * n + quantity) != 0)) + 1
    stretches = [k for k in np.split(np.arange(len(place)), starts) if k.size]
    worst = [k[top[k].argmax()] for k in stretches]
    return [(int(n[k]), int(quantity[k]), float(place[k] * _H)) for k in worst]


def _hermite_peak(f0: np.ndarray, f1: np.ndarray, d0: np.ndarray, d1: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Place in [0, 1] and height of the maximum of the cubics with values f and slopes d at both ends."""
    rise = f1 - f0
    b, c = 3 * rise - 2 * d0 - d1, d0 + d1 - 2 * rise
    # c′ = d0 + 2b x + 3c x²; its falling root, in the form that does not cancel for small c.
    root = np.sqrt(np.maximum(b * b - 3 * c * d0, 0.0))
    below = root - b
    x = np.divide(d0, below, out=np.zeros_like(d0), where=np.abs(below) > 0)
    x = np.clip(x, 0.0, 1.0)
    inner = f0 + x * (d0 + x * (b + x * c))
    top = np.maximum(inner, np.maximum(f0, f1))
    return np.where(inner >= top, x, np.where(f1 >= f0, 1.0, 0.0)), top
