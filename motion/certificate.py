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


def certify(grid: Grid, problem: JointProblem, z: np.ndarray) -> Certificate:
    """Bound all four quantities of the weights z (N,) on every grid interval.

    On an interval |f| stays below the larger end plus h²/8·max|f″|, and max|f″| below its larger end plus
    h²/8·max|f⁗|. Where that does not decide, f is the cubic Hermite polynomial through its ends and slopes
    within h⁴/384·max|f⁗|, and max|f⁗| ≤ Σ|w_i|·max|ψ_i⁽⁴⁾ of f|.
    """
    end = problem.last + 1
    values = (grid.rows[:, :end].reshape(-1, len(z)) @ z).reshape(6, end) / problem.scale(6)
    values[:4] += problem.offsets[:, :end]
    weights = np.abs(grid.weights(z))
    extremes = np.empty((4, 2))
    failures = []
    for quantity in range(4):
        f = values[quantity]
        slope = values[quantity + 1] * problem.duration * _H
        curvature = np.abs(values[quantity + 2]) * (problem.duration * _H) ** 2
        fourth = grid.spread[quantity, : end - 1] @ weights / problem.duration**quantity * _H**4
        bulge = (np.maximum(curvature[:-1], curvature[1:]) + fourth / 8) / 8
        for side, sign in enumerate((-1.0, 1.0)):
            limit = sign * (problem.lower, problem.upper)[side][quantity, : end - 1]
            band = (problem.lower_band, problem.upper_band)[side][quantity, : end - 1]
            allowed = limit + np.where(
                band < 10 * TOUCH * problem.half_range[quantity], 2 * TOUCH * problem.half_range[quantity], 0.0
            )
            peak, places = _side(sign * f, sign * slope, bulge, fourth / 384, allowed)
            extremes[quantity, side] = sign * peak
            failures += [(quantity, s) for s in places]
    return Certificate(extremes, tuple(failures))


def _side(
    f: np.ndarray, slope: np.ndarray, bulge: np.ndarray, remainder: np.ndarray, allowed: np.ndarray
) -> tuple[float, list[float]]:
    """The highest value over all s, and the places where it could pass `allowed`.

    f, slope: (n+1,) values and slopes per interval at the samples; the rest (n,) per interval.
    """
    highest = f.max()
    bound = np.maximum(f[:-1], f[1:]) + bulge
    near = np.flatnonzero((bound > highest) | (bound > allowed))
    if not near.size:
        return float(highest), []
    x, top = _hermite_peak(f[near], f[near + 1], slope[near], slope[near + 1])
    passed = (top + remainder[near] > allowed[near]) & (bound[near] > allowed[near])
    # One row for each stretch of neighbouring intervals, at its highest place.
    stretches = np.split(np.flatnonzero(passed), np.flatnonzero(np.diff(near[passed]) > 1) + 1)
    worst = [k[top[k].argmax()] for k in stretches if k.size]
    return float(max(highest, top.max())), [float((near[k] + x[k]) * _H) for k in worst]


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
