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
    end = problem.last + 1
    extremes = np.empty((len(z), 4, 2))
    failures: list[list[tuple[int, float]]] = [[] for _ in z]
    for side, sign in enumerate((-1.0, 1.0)):  # lower limits are upper ones seen upside down
        limit, band = ((problem.lower, problem.lower_band), (problem.upper, problem.upper_band))[side]
        near = _near_the_top(curves, sign, limit[joints, :, : end - 1], anywhere, step)
        n, k, i = near
        f0, f1 = sign * curves[n, k, i], sign * curves[n, k, i + 1]
        d0, d1 = sign * step * curves[n, k + 1, i], sign * step * curves[n, k + 1, i + 1]
        x, top = _hermite_peak(f0, f1, d0, d1)
        highest = (sign * curves[:, :4, :end]).max(axis=2)
        np.maximum.at(highest, (n, k), top)
        extremes[:, :, side] = sign * highest
        bend = step**2 * np.maximum(np.abs(curves[n, k + 2, i]), np.abs(curves[n, k + 2, i + 1]))
        bound = np.maximum(f0, f1) + (bend + anywhere[n, k] / 8) / 8
        joint = np.asarray(joints)[n]
        allowed = sign * limit[joint, k, i] + _slack(problem.half_range[joint, k], band[joint, k, i])
        open_ = np.flatnonzero((bound > allowed) & (top > allowed - anywhere[n, k] / 384))
        fourth = np.einsum("ij,ij->i", grid.spread[k[open_], i[open_]], weights[n[open_]]) * to_step[k[open_]]
        passed = open_[top[open_] + fourth / 384 > allowed[open_]]
        for m, quantity, s in _highest_of_stretches(n[passed], k[passed], i[passed] + x[passed], top[passed]):
            failures[m].append((quantity, s))
    return [Certificate(*parts) for parts in zip(curves, extremes, map(tuple, failures), strict=True)]


def _with_higher_derivatives(grid: Grid, problem: Problem, z: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Position and its first five derivatives (n, 6, M) on the grid."""
    curves = np.empty((len(z), 6, values.shape[2]))
    curves[:, :4] = values
    higher = (z @ grid.rows[4:].reshape(-1, z.shape[1]).T).reshape(len(z), 2, -1)
    np.divide(higher, problem.duration ** np.array([[4.0], [5.0]]), out=curves[:, 4:])
    return curves


def _near_the_top(
    curves: np.ndarray, sign: float, limit: np.ndarray, anywhere: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Curve, quantity and left sample of all intervals on which the curve may reach its highest or its limit.

    Nowhere does it rise above its samples by more than h²/8·max|f″|, for which one bound a curve is enough.
    """
    count = limit.shape[2]
    moving = curves[:, :, : count + 1]
    bend = step**2 * np.maximum(moving[:, 2:].max(axis=2), -moving[:, 2:].min(axis=2))
    f = moving[:, :4]
    highest = f.max(axis=2) if sign > 0 else -f.min(axis=2)
    tightest = limit.min(axis=2) if sign > 0 else -limit.max(axis=2)
    threshold = (np.minimum(highest, tightest) - (bend + anywhere / 8) / 8)[:, :, None]
    high = f >= threshold if sign > 0 else f <= -threshold
    n, rest = np.divmod(np.flatnonzero(high[:, :, :-1] | high[:, :, 1:]), 4 * count)
    return n, *np.divmod(rest, count)


def _slack(half_range: np.ndarray, band: np.ndarray) -> np.ndarray:
    """By how much a limit may be touched beside a boundary value that lies on it."""
    slack = 2 * TOUCH * half_range
    return np.where(band < 5 * slack, slack, 0.0)


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
