"""Whether joints keep their limits at every time, not only on the grid (design 1.6). All in normalised time."""

from dataclasses import dataclass

import numpy as np

from motion.basis import Grid
from motion.fixed import TOUCH
from motion.limits import SIGNS
from motion.problem import Problem


@dataclass(frozen=True, slots=True)
class Failure:
    """A place between a sample and the next at which a limit could not be shown to hold, by how much."""

    side: int
    quantity: int
    sample: int
    overshoot: float


@dataclass(frozen=True, slots=True, eq=False)
class Certificate:
    """One joint's limits at all times. `curves` (6, M): position and its first five derivatives on the grid.

    `extremes` (4, 2): lowest and highest value over all t. No `failures` means certified.
    """

    curves: np.ndarray
    extremes: np.ndarray
    failures: tuple[Failure, ...]


def certify(grid: Grid, problem: Problem, joints: np.ndarray, x: np.ndarray, curves: np.ndarray) -> list[Certificate]:
    """Bound all four quantities of the joints (n,) with the motions x (n, N+2) and their curves (n, 6, M).

    On an interval |f| stays below the larger end plus h²/8·max|f″|, and max|f″| below its larger end plus
    h²/8·max|f⁗|; and f is the cubic Hermite polynomial through its ends and slopes within h⁴/384·max|f⁗|. The lower of
    both counts. max|f⁗| ≤ Σ|w_i|·max|ψ_i⁽⁴⁾ of f|, with the maxima anywhere, and where that does not decide, with those
    on the interval.
    """
    h, shape = grid.s[1], curves.shape
    weights = np.abs(grid.weights(x))
    anywhere = h**4 * weights.sum(axis=1)[:, None] * grid.peaks
    highest, (side, n, k, i) = _near_the_top(problem, joints, curves, anywhere, h)
    sign = SIGNS[side]
    # Value, slope and curvature at both ends.
    place = (n * shape[1] + k) * shape[2] + i
    f, d, bend = (sign * curves.take(place + step + _ENDS) for step in (0, shape[2], 2 * shape[2]))
    top = _hermite_peak(*f, *(h * d))
    np.maximum.at(highest, (side, n, k), top)
    fourth = anywhere[n, k]
    bound = np.maximum(*f) + (h**2 * np.maximum(*np.abs(bend)) + fourth / 8) / 8
    failures: list[list[Failure]] = [[] for _ in joints]
    doubtful = (np.minimum(bound, top + fourth / 384) > problem.tightest[side, joints[n], k]).nonzero()[0]
    if doubtful.size:
        side, n, k, i, top, bound = (values[doubtful] for values in (side, n, k, i, top, bound))
        fourth = h**4 * np.einsum("ij,ij->i", grid.spread[k, i], weights[n])
        allowed = _allowed(problem, side, joints[n], k, i)
        over = np.minimum(top + fourth / 384, bound) - allowed
        for m in _highest_of_stretches((side * len(joints) + n) * 4 + k, i, over):
            failures[n[m]].append(Failure(int(side[m]), int(k[m]), int(i[m]), float(over[m])))
    extremes = np.array([-highest[0], highest[1]]).transpose(1, 2, 0)
    return [Certificate(*parts) for parts in zip(curves, extremes, map(tuple, failures), strict=True)]


_ENDS = np.array([[0], [1]])


def _near_the_top(
    problem: Problem, joints: np.ndarray, curves: np.ndarray, anywhere: np.ndarray, h: float
) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """The largest samples (2, n, 4), upside down and upright, and (side, curve, quantity, left sample) of all intervals
    on which a curve may rise above them or reach its limit.

    Nowhere does it rise above its samples by more than h²/8·max|f″|, for which one bound a curve is enough.
    """
    moving = curves[:, :, : problem.last + 1]
    largest, smallest = moving.max(axis=2), moving.min(axis=2)
    bulge = (h**2 * np.maximum(largest[:, 2:], -smallest[:, 2:]) + anywhere / 8) / 8
    highest = np.array([-smallest[:, :4], largest[:, :4]])
    threshold = np.minimum(highest, problem.tightest[:, joints]) - bulge
    values = moving[:, :4]
    high = np.empty((2, *values.shape), dtype=bool)
    np.less_equal(values, -threshold[0, :, :, None], out=high[0])
    np.greater_equal(values, threshold[1, :, :, None], out=high[1])
    high[..., :-1] |= high[..., 1:]
    high[..., -1] = False
    rest, i = np.divmod(high.ravel().nonzero()[0], values.shape[2])
    rest, k = np.divmod(rest, 4)
    return highest, (*np.divmod(rest, len(joints)), k, i)


def _allowed(problem: Problem, side: np.ndarray, joint: np.ndarray, k: np.ndarray, i: np.ndarray) -> np.ndarray:
    """The limits, lower ones upside down; beside a boundary value that lies on its limit it may be touched."""
    place = side, joint, k, i
    slack = 2 * TOUCH * problem.half_range[joint, k]
    return problem.limit[place] + np.where(problem.band[place] < 5 * slack, slack, 0.0)


def _highest_of_stretches(curve: np.ndarray, sample: np.ndarray, over: np.ndarray) -> list[int]:
    """Of each stretch of neighbouring intervals of one curve with a positive `over`: which one has the largest."""
    passed = (over > 0).nonzero()[0]
    if not passed.size:
        return []
    starts = np.flatnonzero((np.diff(sample[passed]) > 2) | (np.diff(curve[passed]) != 0)) + 1
    return [int(stretch[over[stretch].argmax()]) for stretch in np.split(passed, starts)]


_NOTHING = 1e-150
"""A divisor below this belongs to a line or parabola that has its maximum at an end."""


def _hermite_peak(f0: np.ndarray, f1: np.ndarray, d0: np.ndarray, d1: np.ndarray) -> np.ndarray:
    """Height of the maximum over [0, 1] of the cubics with values f and slopes d at both ends."""
    rise = f1 - f0
    b, c = 3 * rise - 2 * d0 - d1, d0 + d1 - 2 * rise
    # The slope is d0 + 2b x + 3c x²; where it falls through 0, in the form that does not cancel.
    root = np.sqrt(np.maximum(b * b - 3 * c * d0, 0.0))
    above, below = np.where(b > 0, -b - root, d0), np.where(b > 0, 3 * c, root - b)
    x = np.minimum(np.maximum(above / np.where(np.abs(below) < _NOTHING, 1.0, below), 0.0), 1.0)
    return np.maximum(f0 + x * (d0 + x * (b + x * c)), np.maximum(f0, f1))
