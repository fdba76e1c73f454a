"""The report of a plan, recomputed from its solution."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from motion.limits import QUANTITIES
from motion.primitive import Primitive
from motion.program.constraint_generation import Solution
from motion.program.curves import curves_of, extremes, positions_of
from motion.program.ending import Ending
from motion.program.imitation import imitated
from motion.program.problem import Problem
from motion.request import MotionRequest

BINDING = 1e-5
"""A row whose multiplier is below this part of the largest is not reported as active."""

APART = 6
"""Active control points farther apart than this, two knot intervals in most hulls, belong to different stretches of a
limit."""


class Active(NamedTuple):
    """An active limit: its row has a multiplier at `time_from_start` (s)."""

    joint: int
    quantity: str
    time_from_start: float


class Distance(NamedTuple):
    """Distance between two motions: root mean square and largest, (J,) rad."""

    rms: np.ndarray
    max: np.ndarray

    @classmethod
    def of(cls, apart: np.ndarray) -> "Distance":
        """Rms and maximum of differences of positions (J, n), rad."""
        squares = apart * apart
        return cls(np.sqrt(squares.sum(axis=1) / apart.shape[1]), np.sqrt(squares.max(axis=1)))


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """The report of a plan for J joints.

    imitation_rms: (J,) rms of g̈ − τ²d̈ over the motion, rad/s². final_error_*: (J,) distance from the goal at the hit.
    extremes: for each quantity (J, 2), lowest and highest at any t, stop included. margin: for each quantity (J,),
    least distance to the limit, inf without a limit. active: the active limits. from_demonstration: distance from the
    demonstration at the motion's duration; by_limits: distance from the optimum without limits. phase: where in the
    demonstration the motion begins. basis_count: functions a joint. certified: the limits hold at all times. rounds,
    rows: the largest of any joint.
    """

    imitation_rms: np.ndarray
    final_error_positions: np.ndarray
    final_error_velocities: np.ndarray
    extremes: dict[str, np.ndarray]
    margin: dict[str, np.ndarray]
    active: tuple[Active, ...]
    from_demonstration: Distance
    by_limits: Distance
    phase: float
    basis_count: int
    certified: bool
    rounds: int
    rows: int


def make_report(
    primitive: Primitive, problem: Problem, solution: Solution, points: np.ndarray, ending: Ending
) -> Report:
    """Return the report of a plan whose moving part has the position control points `points` (J, N + 2)."""
    curves, request, arrival, joints = curves_of(points), ending.request, ending.arrival, len(points)
    step = problem.duration / (curves.shape[2] - 1)
    apart = points - problem.imitated.control_points, problem.space.positions(solution.x - problem.origin)
    distance = Distance.of(positions_of(np.concatenate(apart)))
    reach = reached(extremes(curves, problem.duration), ending)
    # A margin is negative only if the motion begins outside a limit.
    margins = np.stack([reach["margin"][name] for name in QUANTITIES], axis=1)
    return Report(
        imitation_rms=_imitation_rms(primitive, request, problem, solution),
        final_error_positions=np.abs(curves[:, 0, -1] - arrival.positions),
        final_error_velocities=np.abs(curves[:, 1, -1] / step - arrival.velocities),
        **reach,
        active=_active(problem, solution),
        from_demonstration=Distance(distance.rms[:joints], distance.max[:joints]),
        by_limits=Distance(distance.rms[joints:], distance.max[joints:]),
        phase=request.phase,
        basis_count=problem.space.count,
        certified=bool((margins >= -2 * request.limits.slack).all()),
        rounds=max(solution.rounds),
        rows=solution.size,
    )


def reached(extremes: np.ndarray, ending: Ending) -> dict[str, Any]:
    """Return the fields `extremes` and `margin` of a motion whose moving part has `extremes` (J, 4, 2)."""
    ranges, both = ending.request.limits.ranges, np.empty(ending.reach.shape)
    low = np.minimum(extremes[..., 0], ending.reach[..., 0], out=both[..., 0])
    high = np.maximum(extremes[..., 1], ending.reach[..., 1], out=both[..., 1])
    margins = np.minimum(low - ranges[..., 0], ranges[..., 1] - high)
    return {
        "extremes": {name: both[:, k] for k, name in enumerate(QUANTITIES)},
        "margin": {name: margins[:, k] for k, name in enumerate(QUANTITIES)},
    }


def _imitation_rms(primitive: Primitive, request: MotionRequest, problem: Problem, solution: Solution) -> np.ndarray:
    """Rms (J,) of g̈ − τ²d̈ over the duration; the final part with zero acceleration counts as not imitated."""
    mean = problem.imitated.missed(problem.space.weights(solution.x[:, :-2])) / problem.duration**4
    if request.rest_fraction:
        last = imitated(primitive, request.imitates[1], 1.0, problem.space.count)
        still = last.missed(0.0) / (request.rest_fraction * request.duration) ** 4
        mean = (1 - request.rest_fraction) * mean + request.rest_fraction * still
    return np.sqrt(mean)


def _active(problem: Problem, solution: Solution) -> tuple[Active, ...]:
    """One entry for each stretch of neighbouring active rows, at their largest multiplier."""
    hull, count, found = problem.hull, len(problem.hull.s), []
    for joint, (rows, multipliers) in enumerate(zip(solution.rows, solution.multipliers, strict=True)):
        each = multipliers.tolist()
        least = BINDING * max(each, default=0.0)
        previous, largest, peaks = -APART - 1, 0.0, []
        for row, multiplier in zip(rows.tolist(), each, strict=True):
            if multiplier <= least:
                continue
            if row - previous > APART:
                peaks.append(row % count)
                largest = multiplier
            elif multiplier > largest:
                peaks[-1], largest = row % count, multiplier
            previous = row
        found += [Active(joint, QUANTITIES[hull.quantity[k]], float(hull.s[k]) * problem.duration) for k in peaks]
    return tuple(found)
