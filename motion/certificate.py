"""Whether a joint keeps its limits at every time, not only on the grid (design 1.6)."""

from dataclasses import dataclass

import numpy as np

from motion.basis import INTERVALS, Grid
from motion.problem import TOUCH, JointProblem

_H = 1 / INTERVALS


@dataclass(frozen=True, slots=True, eq=False)
class Certificate:
    """`extremes` (4, 2): lowest and highest value over all t. `failures`: (quantity, s) of each place where
    the limit could not be shown to hold; none of them means certified."""

    extremes: np.ndarray
    failures: tuple[tuple[int, float], ...]


def certify(grid: Grid, problem: JointProblem, z: np.ndarray, values: np.ndarray) -> Certificate:
    """Bound all four quantities of the weights z (N,), of which `values` (4, M) were evaluated on the grid.

    On an interval |f| stays below the larger end plus h²/8·max|f″|, and max|f″| below its larger end plus
    h²/8·max|f⁗|. Where that does not decide, f is the cubic Hermite polynomial through its ends and slopes
    within h⁴/384·max|f⁗|, and max|f⁗| ≤ Σ|w_i|·max|ψ_i⁽⁴⁾ of f|.
    """
    end = problem.last + 1
    higher = (grid.rows[4:].reshape(-1, len(z)) @ z).reshape(2, -1) / problem.scale(6)[4:]
    values = np.concatenate([values, higher])[:, :end]
    # Derivatives with respect to the place within an interval, from 0 to 1.
    step = problem.duration * _H
    slope, curvature = values[1:5] * step, np.abs(values[2:6]) * step**2
    weights, to_step = np.abs(grid.weights(z)), _H**4 / problem.scale()[:, 0]
    anywhere = (grid.peaks * weights.sum() * to_step)[:, None]
    bulge = (np.maximum(curvature[:, :-1], curvature[:, 1:]) + anywhere / 8) / 8
    # Lower limits are upper ones seen upside down: (2, 4, …).
    sign = np.array([-1.0, 1.0])[:, None, None]
    f, slope = sign * values[:4], sign * slope
    bound = np.maximum(f[..., :-1], f[..., 1:]) + bulge
    allowed = _allowed(problem, end - 1)
    highest = f.max(axis=2)
    side, quantity, near = np.nonzero((bound > highest[:, :, None]) | (bound > allowed))
    at, after = (side, quantity, near), (side, quantity, near + 1)
    x, top = _hermite_peak(f[at], f[after], slope[at], slope[after])
    np.maximum.at(highest, (side, quantity), top)
    fourth = grid.spread[quantity, near] @ weights * to_step[quantity]
    passed = (top + fourth / 384 > allowed[at]) & (bound[at] > allowed[at])
    failures = _highest_of_stretches(quantity[passed], near[passed] + x[passed], top[passed])
    return Certificate((highest * sign[:, :, 0]).T, failures)


def _allowed(problem: JointProblem, count: int) -> np.ndarray:
    """What the lower (upside down) and upper limits are on each of `count` intervals, (2, 4, count)."""
    slack = 2 * TOUCH * problem.half_range
    touching = 5 * slack
    lower = np.where(problem.lower_band < touching, slack, 0.0) - problem.lower
    upper = np.where(problem.upper_band < touching, slack, 0.0) + problem.upper
    return np.stack([lower[:, :count], upper[:, :count]])


def _highest_of_stretches(quantity: np.ndarray, place: np.ndarray, top: np.ndarray) -> tuple[tuple[int, float], ...]:
    """(quantity, s) of the highest place of each stretch of neighbouring intervals."""
    starts = np.flatnonzero((np.diff(place) > 2) | (np.diff(place) < 0) | (np.diff(quantity) != 0)) + 1
    stretches = [k for k in np.split(np.arange(len(place)), starts) if k.size]
    worst = [k[top[k].argmax()] for k in stretches]
    return tuple((int(quantity[k]), float(place[k] * _H)) for k in worst)


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
