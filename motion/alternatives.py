"""Several possible ends of one motion: plan the one that can be imitated best."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from motion.errors import CannotStop, MotionError, OutOfTime
from motion.plan import SplinePlan, WarmStart, plan
from motion.primitive import Primitive
from motion.program.effort import Effort
from motion.program.imitation import imitated
from motion.program.space import make_space
from motion.program.terminal_set import never_stops
from motion.request import Boundary, MotionRequest

EFFORT, EFFORT_EACH, PLAN = 10_000.0, 3_500.0, 1_000.0
"""Effort of all plans together (for up to six joints), of each plan, and the fixed part of each plan beside its
programs; µs on the machine of benchmarks/README.md."""

IMPROVING = 0.4
"""Once one end is planned, better ends are tried while more than this part of the initial effort is left."""

_ENDS = np.arange(2)
"""The quantities that an end prescribes: position and velocity."""


@dataclass(frozen=True, slots=True, eq=False)
class End:
    """An end of a motion: the state to reach, and the duration, s."""

    goal: Boundary
    duration: float


class AllRefused(Exception):
    """No end can be planned; `errors` has the reason for each end."""

    def __init__(self, errors: list[MotionError]) -> None:
        super().__init__(f"none of {len(errors)} ends can be planned; the first: {errors[0]}")
        self.errors = errors


def plan_best(
    primitive: Primitive,
    request: MotionRequest,
    ends: Sequence[End],
    tick: float = 0.001,
    warm: WarmStart | None = None,
    verify: Callable[[SplinePlan], None] | None = None,
) -> tuple[int, SplinePlan]:
    """Plan the motion to the feasible end with the least imitation error; return its index and the plan.

    The error is the mean square of g̈ − τ²d̈, each joint in units of its acceleration limit. The error without limits
    is a lower bound. Ends are planned in the order of this bound, until no remaining end can be better or the effort is
    spent. The first plan is warm-started with `warm`, each later one with the active rows of the best plan so far.
    `verify` is called with each plan that is the best so far; the end is refused if it raises a MotionError. The goal
    and duration of `request` are ignored. Raises AllRefused if no end can be planned.
    """
    bounds = least_errors(primitive, request, ends)
    scale = _scale(request)
    effort = Effort(EFFORT * max(1.0, request.joint_count / 6))
    least = IMPROVING * effort.left
    outside, cannot_stop = _infeasible(request, ends)
    tried: dict[int, MotionError] = {}
    best: tuple[float, int, SplinePlan] | None = None
    for index in np.argsort(bounds, kind="stable").tolist():
        if effort.left <= 0 or (best is not None and (bounds[index] >= best[0] or effort.left <= least)):
            break
        if outside[index] or cannot_stop[index].any():
            continue
        try:
            asked = replace(request, goal=ends[index].goal, duration=ends[index].duration)
            with effort.share(EFFORT_EACH) as share:
                made = plan(primitive, asked, tick, warm, remedy=False, thorough=False, effort=share)
            error = float(((made.report.imitation_rms / scale) ** 2).sum())
            if best is not None and error >= best[0]:
                continue
            if verify is not None:
                verify(made)
        except MotionError as refusal:
            tried[index] = refusal
            continue
        finally:
            effort.left -= PLAN
        best, warm = (error, index, made), made.warm
    if best is None:
        raise AllRefused([tried.get(k) or _refused(request, end, cannot_stop[k]) for k, end in enumerate(ends)])
    return best[1], best[2]


def least_errors(primitive: Primitive, request: MotionRequest, ends: Sequence[End]) -> np.ndarray:
    """Errors (n,) of the motions to the ends without limits, which are lower bounds.

    In normalised time, let C be the rows of the equalities, and b (m,) the residuals of the demonstration in them. The
    error of the optimum is bᵀ(CCᵀ)⁻¹b/T⁴. A prescribed final acceleration is left out, since it can only add to the
    error.
    """
    begin, end = request.imitates
    part = imitated(primitive, begin, end, primitive.basis_count)
    rows, inverses = _end_rows(primitive.basis_count)
    durations = np.array([end.duration for end in ends])[:, None]
    moving, straight = durations * (1 - request.rest_fraction), durations * request.rest_fraction
    positions, velocities = (np.array([values[k] for values in map(_values, ends)]) for k in (0, 1))
    start, shape = request.start, positions.shape
    targets = np.stack(
        [
            positions - straight * velocities - start.positions - moving * start.velocities,
            moving * (velocities - start.velocities),
            np.broadcast_to(np.nan_to_num(start.accelerations), shape) * moving**2,
        ],
        axis=2,
    )
    missed = targets - part.weights @ rows.T
    inverse = inverses[np.isnan(start.accelerations).astype(int)]
    errors = (np.matmul(missed.transpose(1, 0, 2), inverse) * missed.transpose(1, 0, 2)).sum(axis=2).T
    return (errors / moving**4 / _scale(request) ** 2).sum(axis=1)


@cache
def _end_rows(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows (3, N) on the weights: final position, final velocity, acceleration at the start.

    Also (CΨ⁻¹Cᵀ)⁻¹ (2, 3, 3): of all three rows, and of the first two, padded with zeros.
    """
    space = make_space(count, 0.0)
    rows = np.concatenate([space.rows_at(k, np.array([s])) for k, s in ((0, 1.0), (1, 1.0), (2, 0.0))])[:, :-2]
    inverses = np.zeros((2, 3, 3))
    inverses[0] = np.linalg.inv(rows @ rows.T)
    inverses[1, :2, :2] = np.linalg.inv(rows[:2] @ rows[:2].T)
    return rows @ space.factor.T, inverses


def _infeasible(request: MotionRequest, ends: Sequence[End]) -> tuple[np.ndarray, np.ndarray]:
    """Which ends (n,) lie outside the limits, and at which of the other ends which joints (n, J) cannot stop."""
    slack = request.limits.slack.T[:2]
    values = np.array([_values(end) for end in ends])
    outside: np.ndarray = np.any(request.limits.outside(_ENDS, values, slack), axis=(1, 2))  # type: ignore[assignment]
    cannot_stop = np.zeros((len(ends), request.joint_count), dtype=bool)
    inside = np.flatnonzero(~outside)
    if request.tail == "stop" and inside.size:
        cannot_stop[inside] = never_stops(request, [ends[k].goal for k in inside.tolist()])
    return outside, cannot_stop


def _refused(request: MotionRequest, end: End, cannot_stop: np.ndarray) -> MotionError:
    """The error of an end that was not planned."""
    if error := request.limits.exceeded(_ENDS, np.array(_values(end))):
        return error
    return CannotStop(int(cannot_stop.argmax()), None) if cannot_stop.any() else OutOfTime(0)


def _values(end: End) -> tuple[np.ndarray, np.ndarray]:
    return end.goal.positions, end.goal.velocities


def _scale(request: MotionRequest) -> np.ndarray:
    """Units (J,) of the joints' errors: the acceleration limit, rad/s², or 1 without a limit."""
    limits = request.limits.accelerations
    return np.where(np.isfinite(limits), limits, 1.0)
