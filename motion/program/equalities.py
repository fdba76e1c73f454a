"""The values that a request prescribes, and the equalities that they give in normalised time."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from motion.errors import InvalidMotion, SolverFailed
from motion.limits import RETURN_FROM, ROUNDING
from motion.program.space import Space, make_space
from motion.request import MotionRequest

DIGITS = 12
"""Digits to which the s of waypoints are rounded, so that requests that differ in duration only share matrices."""

DEPENDENT = 1e-10
"""A unit row is dependent if its part outside the span of the rows before it is smaller."""


@dataclass(frozen=True, slots=True, eq=False)
class Fixed:
    """F values prescribed by the request of J joints: the three of the start first, the three of the end last.

    quantity (F,): 0 position, 1 velocity, 2 acceleration. s (F,): where. values (F, J): NaN if free. touched: places
    between the ends at which a value lies on its limit.
    """

    quantity: np.ndarray
    s: np.ndarray
    values: np.ndarray
    touched: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Equalities:
    """Equalities rows·x = targets on the motions x (J, N + 2) of J joints.

    rows (J, m, N + 2): zero where a joint's value is free. kind: for each joint, an index of `spans`. spans:
    orthonormal bases (N, m) of the rows on steps of z, one for each set of prescribed values in each metric. changes:
    for each span, the matrix from steps of z in a joint's own metric to steps of z in the space's; None if they are the
    same. adaptation (J, m, N): the least change of z for a unit of each target, in the metric in which the
    demonstration is adapted.
    """

    rows: np.ndarray
    kind: list[int]
    spans: list[np.ndarray]
    changes: list[np.ndarray | None]
    adaptation: np.ndarray

    def steps(self, joints: Iterable[int], steps: np.ndarray) -> np.ndarray:
        """Convert steps (n, N) of z in the joints' own metrics to steps in the space's metric."""
        if not any(change is not None for change in self.changes):
            return steps
        changes = [self.changes[self.kind[joint]] for joint in joints]
        return np.array(
            [step if change is None else change @ step for change, step in zip(changes, steps, strict=True)]
        )

    def missed(self, x: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """Residuals (J, m) of motions x (J, N + 2) in the equalities with `targets` (J, m)."""
        return targets - np.matmul(self.rows, x[:, :, None])[:, :, 0]

    def adapted(self, x: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """Move motions x (J, N + 2), in place, to the nearest ones that meet the targets; return them."""
        x[:, :-2] += np.matmul(self.missed(x, targets)[:, None], self.adaptation)[:, 0]
        return x


def fixed_values(request: MotionRequest) -> Fixed:
    """Return the values that the request prescribes for its moving part, in physical units.

    A waypoint on a limit also prescribes the derivative: the quantity can only have an extremum there.
    """
    start, goal = request.start, request.goal
    s, passed, touched = _passed(request) if request.waypoints else ([], np.empty((0, request.joint_count)), ())
    end = goal.positions - request.rest_fraction * request.duration * goal.velocities
    values = np.concatenate([start.state, passed, (end, goal.velocities, request.final_accelerations)])
    return Fixed(np.arange(len(values)) % 3, np.array([0.0, *s, 1.0]).repeat(3), values, touched)


def _passed(request: MotionRequest) -> tuple[list[float], np.ndarray, tuple[float, ...]]:
    """Places s of n waypoints, the three values (3n, J) of each, and the places at which a value touches its limit."""
    ranges = request.limits.ranges
    s = [round(time / request.moving_duration, DIGITS) for time in request.waypoint_times]
    positions, given = (np.array([getattr(w, name) for w in request.waypoints]) for name in ("positions", "velocities"))
    turning = _touches(positions, ranges[:, 0])
    velocities = np.where(turning & np.isnan(given), 0.0, given)
    fastest = _touches(velocities, ranges[:, 1])
    values = np.stack([positions, velocities, np.where(fastest, 0.0, np.nan)], axis=1)
    touched = np.flatnonzero((turning | fastest).any(axis=1)).tolist()
    return s, values.reshape(-1, request.joint_count), tuple(s[k] for k in touched)


def fixed_inside(request: MotionRequest) -> tuple[MotionRequest, Fixed]:
    """Return the request, with values that exceed a limit by rounding set to the limit, and its prescribed values.

    Raises LimitExceeded for the first joint's first prescribed value outside its range.
    """
    fixed = fixed_values(request)
    if request.rest_fraction or request.limits.outside(fixed.quantity, fixed.values).any():
        request = request.clipped()
        fixed = fixed_values(request)
        returning = np.where(np.arange(len(fixed.s)) == 0, RETURN_FROM, 0.0)[:, None]
        waypoints = [f" of waypoints[{k}]" for k in range(len(request.waypoints)) for _ in range(3)]
        rests = ""
        if request.rest_fraction:
            rests = f" where the rest_fraction, here at most {_most_rest(request):.3f}, begins"
        of = [" of the start"] * 3 + waypoints + [rests, "", ""]
        if error := request.limits.exceeded(fixed.quantity, fixed.values, returning, of):
            raise error
    return request, fixed


def _most_rest(request: MotionRequest) -> float:
    """Return the largest rest_fraction, rounded down, that begins inside the position limits."""
    goal, velocities = request.goal.positions, np.abs(request.goal.velocities)
    low, high = request.limits.positions.T
    room = np.where(request.goal.velocities < 0, high - goal, goal - low)
    within = room[velocities > 0] / (request.duration * velocities[velocities > 0])
    return math.floor(1e3 * max(within.min(initial=1.0), 0.0)) / 1e3


def equalities_of(
    space: Space, fixed: Fixed, values: np.ndarray, local: bool, own: tuple[Space, ...]
) -> tuple[Equalities, np.ndarray]:
    """Return the equalities of `values` (F, J), in normalised time, and their targets (J, m).

    The start's position and velocity are coordinates of x and need no row. local: adapt the demonstration in the
    space's own metric, otherwise in the metric of accelerations alone. own: the metrics of the J joints, if they differ
    from the space's. Raises InvalidMotion for more values of a joint than a motion has weights, SolverFailed for
    linearly dependent values.
    """
    values = values[2:]
    given = values == values  # not NaN
    if len(values) > space.count and (most := int(given.sum(axis=0).max())) > space.count:
        sentence = f"fix, with both ends, {most} values of a joint; at most {space.count} can be met: leave some out"
        raise InvalidMotion("waypoints", sentence)
    pattern = tuple(fixed.quantity[2:].tolist()), tuple(fixed.s[2:].tolist()), given.T.tobytes()
    return _equalities(space, *pattern, local, own), np.where(given, values, 0.0).T


@lru_cache(maxsize=64)
def _equalities(
    space: Space, quantity: tuple[int, ...], s: tuple[float, ...], given: bytes, local: bool, own: tuple[Space, ...]
) -> Equalities:
    """The equalities that prescribe the `given` (J, m) of the quantities at the places s."""
    masks = np.frombuffer(given, dtype=bool).reshape(-1, len(s))
    plain = make_space(space.count, 0.0)
    every, on_plain = (_rows(metric, quantity, s) for metric in (space, plain))
    of_joint = [(mask.tobytes(), own[joint] if own else None) for joint, mask in enumerate(masks)]
    kinds = list(dict.fromkeys(of_joint))
    changes = [metric and space.steps_from(metric) for _, metric in kinds]
    factored = []
    for kind, change in zip(kinds, changes, strict=True):
        mask, joint = np.frombuffer(kind[0], dtype=bool), of_joint.index(kind)
        rows, span, adaptation = _factored(every, mask, joint, change)
        if not local:
            *_, adaptation = _factored(on_plain, mask, joint)
            adaptation = space.whitened(adaptation @ plain.whitening)
        factored.append((rows, span, adaptation))
    kind = [kinds.index(each) for each in of_joint]
    rows, adaptation = (np.array([factored[k][part] for k in kind]) for part in (0, 2))
    return Equalities(rows, kind, [span for _, span, _ in factored], changes, adaptation)


def _rows(space: Space, quantity: tuple[int, ...], s: tuple[float, ...]) -> np.ndarray:
    """Rows (m, N + 2) on x of the quantities at the places s."""
    quantities, places, rows = np.array(quantity), np.array(s), np.empty((len(s), space.count + 2))
    for each in set(quantity):
        rows[quantities == each] = space.rows_at(each, places[quantities == each])
    return rows


def _factored(
    every: np.ndarray, mask: np.ndarray, joint: int, change: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows of one joint, an orthonormal basis of their span, and the least change of z for a unit of each target."""
    rows = np.where(mask[:, None], every, 0.0)
    on_weights = rows[mask, :-2] if change is None else rows[mask, :-2] @ change
    norms = np.linalg.norm(on_weights, axis=1)
    q, r = np.linalg.qr((on_weights / norms[:, None]).T)
    if np.abs(np.diag(r)).min(initial=1.0) < DEPENDENT:
        raise SolverFailed(joint, "the fixed values depend on each other")
    span = np.zeros((on_weights.shape[1], len(rows)))
    span[:, mask] = q
    correction = np.zeros(span.T.shape)
    correction[mask] = (q @ np.linalg.inv(r.T) / norms).T
    return rows, span, correction if change is None else correction @ change.T


def _touches(values: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """Whether values (n, J) lie on one of their limits (J, 2), up to rounding."""
    width = ranges[:, 1] - ranges[:, 0]
    near = 1e-3 * ROUNDING * np.where(np.isfinite(width), width, 1.0)
    return np.abs(values[..., None] - ranges).min(axis=2) <= near
