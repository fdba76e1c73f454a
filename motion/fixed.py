"""The values that a request fixes, and what they demand of a motion (design 1.1, 1.5)."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from motion.basis import Grid
from motion.errors import InvalidMotion, LimitExceeded, SolverFailed
from motion.limits import LED_BACK_FROM, QUANTITIES
from motion.request import MotionRequest

TOUCH = 1e-6
"""Beside a boundary value on its limit, certified means within this part of the limit's range."""

FIXED_TOLERANCE = 1e-9
"""Values fixed by the request may pass their limit by this part of its range: rounding."""

Joints = np.ndarray | list[int] | slice


@dataclass(frozen=True, slots=True, eq=False)
class Fixed:
    """F values fixed by the request of J joints: the start's three first, the end's three last.

    quantity (F,): 0 position, 1 velocity, 2 acceleration; s (F,): where; values (F, J): NaN where it is free; slack
    (2, J, F): how far inside the lower and the upper limit.
    """

    quantity: np.ndarray
    s: np.ndarray
    values: np.ndarray
    slack: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Equalities:
    """What fixed values demand of the motions x (J, N+2) of J joints: rows·x = targets.

    rows (J, m, N+2), zero beyond a joint's own; span (J, N, m): an orthonormal basis of the rows on z; correction
    (J, m, N): the least change of z for a unit of each target.
    """

    rows: np.ndarray
    span: np.ndarray
    correction: np.ndarray

    def missed(self, x: np.ndarray, targets: np.ndarray, joints: Joints = slice(None)) -> np.ndarray:
        """How far (n, m) the joints' motions x (n, N+2) are from their targets, which are those of all (J, m)."""
        return targets[joints] - (self.rows[joints] @ x[:, :, None])[:, :, 0]

    def nearest(self, x: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """The nearest motions that meet the targets; corrected twice, so that they hold to rounding."""
        every = slice(None)
        return self.corrected(every, self.corrected(every, x.copy(), targets), targets)

    def corrected(self, joints: Joints, x: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """The joints' motions x (n, N+2), in place, brought to their targets by the least change."""
        x[:, :-2] += (self.missed(x, targets, joints)[:, None] @ self.correction[joints])[:, 0]
        return x


def fixed_values(request: MotionRequest) -> Fixed:
    """What the request fixes, in physical units.

    With a rest fraction ρ the moving part ends at s = 1−ρ, from where a straight line leads to the goal
    (design 1.9). A way-point that touches a limit fixes the derivative as well: it can only turn there.
    """
    start, goal, limits, end = request.start, request.goal, request.limits, request.moving_fraction
    fixed = [(0, 0.0, start.positions), (1, 0.0, start.velocities), (2, 0.0, start.accelerations)]
    for waypoint in request.waypoints:
        s = waypoint.time_from_start / request.duration
        on_limit = np.abs(waypoint.positions[:, None] - limits.positions).min(axis=1) <= _touching(limits.positions)
        velocities = np.where(on_limit & np.isnan(waypoint.velocities), 0.0, waypoint.velocities)
        fastest = np.abs(np.abs(velocities) - limits.velocities) <= _touching(limits.ranges[:, 1])
        fixed += [(0, s, waypoint.positions), (1, s, velocities), (2, s, np.where(fastest, 0.0, np.nan))]
    end_positions = goal.positions - (1 - end) * request.duration * goal.velocities
    fixed += [(0, end, end_positions), (1, end, goal.velocities), (2, end, request.final_accelerations)]
    quantity, s, values = zip(*fixed, strict=True)
    quantity, values = np.array(quantity), np.array(values)
    ranges = limits.ranges[:, quantity]
    slack = np.array([values.T - ranges[:, :, 0], ranges[:, :, 1] - values.T])
    return Fixed(quantity, np.array(s), values, slack)


def check_fixed(request: MotionRequest, fixed: Fixed) -> None:
    """Raises LimitExceeded for the first joint's first fixed value outside its range."""
    if not (fixed.slack < 0).any():
        return
    ranges = request.limits.ranges[:, fixed.quantity]
    width = ranges[:, :, 1] - ranges[:, :, 0]
    width = np.where(np.isfinite(width), width, 1.0)
    tolerance = np.where(fixed.s == 0, 2 * TOUCH, FIXED_TOLERANCE) * width
    tolerance[:, 0] = LED_BACK_FROM
    outside = (fixed.slack < -tolerance).any(axis=0)
    if outside.any():
        joint, k = np.unravel_index(outside.argmax(), outside.shape)
        bound = ranges[joint, k, fixed.slack[:, joint, k].argmin()]
        raise LimitExceeded(int(joint), QUANTITIES[fixed.quantity[k]], float(fixed.values[k, joint]), float(bound))


def equalities_of(grid: Grid, fixed: Fixed, values: np.ndarray) -> tuple[Equalities, np.ndarray]:
    """The equalities of `values` (F, J), in normalised time, and their targets (J, m).

    The start's position and velocity are coordinates and need no row. Raises InvalidMotion for more values of a joint
    than a motion has weights, SolverFailed for values that depend on each other.
    """
    given = ~np.isnan(values[2:])
    most, weights = int(given.sum(axis=0).max()), len(grid.whitening)
    if most > weights:
        raise InvalidMotion(
            "waypoints", f"fix, with both ends, {most} values of a joint; at most {weights} can be met: leave some out"
        )
    equalities = _equalities(grid, tuple(fixed.quantity[2:]), tuple(fixed.s[2:]), given.T.tobytes())
    return equalities, np.where(given, values[2:], 0.0).T


@lru_cache(maxsize=64)
def _equalities(grid: Grid, quantity: tuple[int, ...], s: tuple[float, ...], given: bytes) -> Equalities:
    """The equalities that fix the `given` (J, m) of the quantities at the places s."""
    masks = np.frombuffer(given, dtype=bool).reshape(-1, len(s))
    every = np.array([grid.row_at(*place) for place in zip(quantity, s, strict=True)])
    factored = {}
    for joint, mask in enumerate(masks):
        if mask.tobytes() not in factored:
            factored[mask.tobytes()] = _factored(every, mask, joint)
    parts = zip(*(factored[mask.tobytes()] for mask in masks), strict=True)
    return Equalities(*(np.array(part) for part in parts))


def _factored(every: np.ndarray, mask: np.ndarray, joint: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One joint's rows, span and correction."""
    rows = np.where(mask[:, None], every, 0.0)
    on_weights = rows[mask, :-2]
    norms = np.linalg.norm(on_weights, axis=1)
    q, r = np.linalg.qr((on_weights / norms[:, None]).T)
    if np.abs(np.diag(r)).min() < 1e-10:
        raise SolverFailed(joint, "the fixed values depend on each other")
    span = np.zeros((on_weights.shape[1], len(rows)))
    span[:, mask] = q
    correction = np.zeros(span.T.shape)
    correction[mask] = (q @ np.linalg.inv(r.T) / norms).T
    return rows, span, correction


def _touching(ranges: np.ndarray) -> np.ndarray:
    """How near (J,) to a limit with these ranges (J, 2) a value lies on it."""
    width = ranges[:, 1] - ranges[:, 0]
    return FIXED_TOLERANCE * np.where(np.isfinite(width), width, 1.0)
