"""Several ends for one motion: the one that can be imitated best is planned."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from motion.errors import MotionError, OutOfTime
from motion.plan import Plan, Warm, effort_for, plan
from motion.primitive import Primitive
from motion.program.imitation import imitated
from motion.program.space import make_space
from motion.request import Boundary, MotionRequest

EFFORT_EACH = 4_000.0
"""What the plan of one end may take while there are others; see `motion.program.effort`."""


@dataclass(frozen=True, slots=True, eq=False)
class End:
    """A state to arrive at, and after how many seconds."""

    goal: Boundary
    duration: float


class AllRefused(Exception):
    """None of the ends can be planned; `errors` says why not, one for each end."""

    def __init__(self, errors: list[MotionError]) -> None:
        super().__init__(f"none of {len(errors)} ends can be planned; the first: {errors[0]}")
        self.errors = errors


def plan_best(
    primitive: Primitive, request: MotionRequest, ends: Sequence[End], tick: float = 0.001, warm: Warm | None = None
) -> tuple[int, Plan]:
    """Plan the motion to the feasible one of the ends whose error is least; return its index and the plan.

    The error is the mean square of g̈ − τ²d̈, each joint in units of its acceleration limit. Ends are planned in the
    order of what the error would be without limits, which it cannot be below, until no other can be better or the
    effort is spent. Goal and duration of `request` are not used. Raises AllRefused.
    """
    requests = [replace(request, goal=end.goal, duration=end.duration) for end in ends]
    bounds = least_errors(primitive, request, ends)
    scale = _scale(request)
    effort = effort_for(request.joint_count)
    errors: list[MotionError] = [OutOfTime(0) for _ in ends]
    best: tuple[float, int, Plan] | None = None
    for index in np.argsort(bounds, kind="stable").tolist():
        if effort.left <= 0 or (best is not None and bounds[index] >= best[0]):
            break
        share = effort.share(EFFORT_EACH)
        try:
            made = plan(primitive, requests[index], tick, warm, remedy=False, effort=share)
        except MotionError as error:
            errors[index] = error
            continue
        finally:
            effort.give_back(share)
        error = float(((made.report.imitation_rms / scale) ** 2).sum())
        if best is None or error < best[0]:
            best = error, index, made
    if best is None:
        raise AllRefused(errors)
    return best[1], best[2]


def least_errors(primitive: Primitive, request: MotionRequest, ends: Sequence[End]) -> np.ndarray:
    """The errors (n,) that motions to the ends would have without limits.

    With b (m,) what the demonstration misses of its equalities, C their rows and lengths in normalised time, the error
    of the optimum is bᵀ(CCᵀ)⁻¹b/T⁴. A given final acceleration is left out: it can only add to it.
    """
    begin, end = request.imitates
    part = imitated(primitive, begin, end, primitive.basis_count)
    space = make_space(primitive.basis_count, 0.0)
    rows = np.concatenate([space.rows_at(k, np.array([s])) for k, s in ((0, 1.0), (1, 1.0), (2, 0.0))])
    moving = np.array([end.duration for end in ends])[:, None] * (1 - request.rest_fraction)
    straight = np.array([end.duration for end in ends])[:, None] * request.rest_fraction
    positions, velocities = (
        np.array([getattr(end.goal, name) for end in ends]) for name in ("positions", "velocities")
    )
    start, shape = request.start, positions.shape
    demonstrated = space.whitened(part.weights) @ rows[:, :-2].T
    targets = np.stack(
        [
            positions - straight * velocities - start.positions - moving * start.velocities,
            moving * (velocities - start.velocities),
            np.broadcast_to(start.accelerations, shape) * moving**2,
        ],
        axis=2,
    )
    missed = targets - demonstrated
    free = np.isnan(start.accelerations)
    errors = np.empty(shape)
    for joints, used in ((free, slice(0, 2)), (~free, slice(0, 3))):
        if joints.any():
            inverse = np.linalg.inv(rows[used, :-2] @ rows[used, :-2].T)
            b = missed[:, joints, used]
            errors[:, joints] = np.einsum("kji,il,kjl->kj", b, inverse, b)
    return (errors / moving**4 / _scale(request) ** 2).sum(axis=1)


def _scale(request: MotionRequest) -> np.ndarray:
    """The units (J,) of the joints' errors, rad/s²."""
    limits = request.limits.accelerations
    return np.where(np.isfinite(limits), limits, 1.0)
