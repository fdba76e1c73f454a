"""The quadratic programs of all joints in normalised time (design 1.1, 1.5, 1.6).

Rows belong to the basis; a request changes right-hand sides only. Equalities fix what the request fixes,
limits are demanded on the grid a little inside their true place.
"""

from dataclasses import dataclass

import numpy as np

from motion.basis import Grid
from motion.fixed import Equalities, Fixed, equalities_of
from motion.limits import LED_BACK_BY
from motion.request import MotionRequest

BAND = 1e-3
"""Rows are demanded at this part of half the limit's range inside the limit (ε of design 1.6)."""

TAPER = 0.1
"""Distance in s from a fixed boundary value within which the band grows to its full width."""


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """For each of J joints: minimise |z − z_d|² subject to equalities and the limits on the grid.

    All in normalised time: quantity k is the k-th derivative with respect to s. Arrays over sides (lower, upper),
    joints, quantities and samples have shape (2, J, 4, M): value·sign ≤ `limit` has to hold, rows are demanded `band`
    inside of it; the limit is infinite where there is none or the motion is over. `constant`: both are the same at all
    samples. `half_range` (J, 4) is their scale, `tightest` (2, J, 4) the smallest limit. `last`: the index of the last
    sample in motion. `target` (J, N): z_d; `origin` (J, N+2): the optimum without limits.
    """

    duration: float
    last: int
    equalities: Equalities
    targets: np.ndarray
    target: np.ndarray
    origin: np.ndarray
    limit: np.ndarray
    band: np.ndarray
    constant: bool
    half_range: np.ndarray
    tightest: np.ndarray


def build(grid: Grid, request: MotionRequest, fixed: Fixed, theta: np.ndarray, confined: np.ndarray) -> Problem:
    """The problem of all joints: imitate `theta` (J, N).

    `confined` (J, 2) are the intervals that free final accelerations may use (design 1.9). What is fixed has been
    checked. Raises InvalidMotion for too many fixed values, SolverFailed for some that depend on each other.
    """
    powers = request.duration ** np.arange(4.0)
    ranges = request.limits.ranges * powers[:, None]
    low, high = confined.T * powers[2]
    half = _half(ranges)
    values = fixed.values * powers[fixed.quantity, None]
    slack = fixed.slack * powers[fixed.quantity]
    # A narrower interval than the bands of its row is a value.
    free = np.isnan(values[-1])
    narrow = free & (high - low <= 4 * BAND * half[:, 2])
    if narrow.any():
        middle = values[-1, narrow] = (low[narrow] + high[narrow]) / 2
        slack[:, narrow, -1] = middle - ranges[narrow, 2, 0], ranges[narrow, 2, 1] - middle
    last = round(request.moving_fraction * grid.intervals)
    limit, band, constant = _limits(grid, fixed, slack, ranges, half, last)
    for joint in (free & ~narrow & ((low > ranges[:, 2, 0]) | (high < ranges[:, 2, 1]))).nonzero()[0]:
        here = slice(None), joint, 2, last
        limit[here] = np.minimum(limit[here], [-low[joint], high[joint]])
        band[here] = np.minimum(band[here], (high[joint] - low[joint]) / 4)
        constant = False
    equalities, targets = equalities_of(grid, fixed, values)
    target = grid.whiten(theta)
    start = np.concatenate([target, values[:2].T], axis=1)
    return Problem(
        duration=request.duration,
        last=last,
        equalities=equalities,
        targets=targets,
        target=target,
        origin=equalities.nearest(start, targets),
        limit=limit,
        band=band,
        constant=constant,
        half_range=half,
        tightest=limit[..., 0] if constant else limit[..., : last + 1].min(axis=3),
    )


def _limits(
    grid: Grid, fixed: Fixed, slack: np.ndarray, ranges: np.ndarray, half: np.ndarray, last: int
) -> tuple[np.ndarray, np.ndarray, bool]:
    """True limits and bands, (2, J, 4, M) each: none after the last sample, wider at a start that lies outside; and
    whether they are the same at all samples.

    The band is μ(s) = min(εr, m + εr(d/0.1)³) (design 1.6).
    """
    shape = 2, *half.shape, len(grid.s)
    constant = np.array([-ranges[:, :, 0], ranges[:, :, 1]])
    limit, band = np.empty(shape), np.empty(shape)
    limit[:], band[:] = constant[..., None], BAND * half[:, :, None]
    beside = (slack < BAND * half[:, fixed.quantity]).nonzero()
    for side, joint, k in zip(*beside, strict=True):
        here = side, joint, fixed.quantity[k]
        inside = slack[side, joint, k]
        if inside < 0 and k < 3:
            limit[here][: round(LED_BACK_BY * grid.intervals)] -= inside
        taper = max(inside, 0.0) + BAND * half[here[1:]] * (np.abs(grid.s - fixed.s[k]) / TAPER) ** 3
        np.minimum(band[here], taper, out=band[here])
    if last < grid.intervals:
        limit[..., last + 1 :] = np.inf
    return limit, band, not beside[0].size and last == grid.intervals


def _half(ranges: np.ndarray) -> np.ndarray:
    """Half of each limit's range (…, 2); 1 where it is unbounded."""
    half = (ranges[..., 1] - ranges[..., 0]) / 2
    return np.where(np.isfinite(half), half, 1.0)
