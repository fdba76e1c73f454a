"""Plans without a certificate: motions of method "gaussian" and "dmp", which promise nothing between their samples.

Their report says how far they reach, and `check_limits` refuses what leaves the limits: what is checked are the
polynomials that are played.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import simpson

from motion.braking import fastest_stop
from motion.limits import QUANTITIES
from motion.primitive import Primitive
from motion.program.curves import STEPS, curves_of_pieces, extremes
from motion.program.report import Distance, Report, by_quantity, margins
from motion.request import Boundary, MotionRequest
from motion.trajectory import ARRIVED, COEFFICIENTS, Samples, Trajectory

COMPARED = 2001
"""Instants at which a motion is compared with its demonstration."""


@dataclass(frozen=True, slots=True, eq=False)
class SampledPlan:
    """A motion with its tail that was not certified; the fields are those of `motion.plan.Plan`.

    trajectory: all of it. duration: up to the hit, s. total_duration: with the tail, s, a multiple of `tick`.
    hit_index: the tick nearest to the hit.
    """

    request: MotionRequest
    trajectory: Trajectory
    duration: float
    total_duration: float
    hit_index: int
    tick: float
    report: Report

    def sample(self, times: np.ndarray) -> Samples:
        """States at `times` (n,), s from the start; beyond the end the arm rests (or coasts)."""
        return self.trajectory.sample(times)

    def samples(self) -> Samples:
        """States on the tick grid, the first at 0, the last at `total_duration` (with a tail "stop" at rest)."""
        count = round(self.total_duration / self.tick)
        return self.sample(np.arange(count + 1) * self.tick)


def check_limits(plan: SampledPlan) -> None:
    """Raise LimitExceeded for the first limit that the plan leaves by more than rounding."""
    reached = np.concatenate([plan.report.extremes[name] for name in QUANTITIES], axis=1).T
    if error := plan.request.limits.exceeded(np.repeat(np.arange(len(QUANTITIES)), 2), reached):
        raise error


def make_plan(
    primitive: Primitive,
    request: MotionRequest,
    moving: Trajectory,
    arrival: Boundary,
    tick: float,
    basis_count: int,
    by_limits: Distance,
) -> SampledPlan:
    """Return the plan of a motion.

    moving: the moving part, in pieces of equal length. arrival: the state (J,) from which the tail goes on, straight
    ahead where the request asks for it, and the stop. by_limits: distance from the motion without limits.
    """
    trajectory, reach = _with_tail(request, moving, arrival)
    hit = moving.duration + request.rest_fraction * request.duration
    return SampledPlan(
        request=request,
        trajectory=trajectory,
        duration=hit,
        total_duration=math.ceil(trajectory.duration / tick - 1e-9) * tick,
        hit_index=round(hit / tick),
        tick=tick,
        report=_report(primitive, request, trajectory, hit, reach, basis_count, by_limits),
    )


def _with_tail(request: MotionRequest, moving: Trajectory, arrival: Boundary) -> tuple[Trajectory, np.ndarray]:
    """All of the motion; its lowest and highest position, velocity, acceleration and jerk (J, 4, 2)."""
    straight, limits = request.straight_duration, request.limits
    length = moving.duration / len(moving.coefficients)
    curves = curves_of_pieces(moving.coefficients * length ** np.arange(float(COEFFICIENTS)))
    reach = extremes(curves) * (length / STEPS) ** -np.arange(4.0)[:, None]
    trajectory, stops_at = moving, arrival.positions + straight * arrival.velocities
    reach[:, 0] = np.stack([np.minimum(reach[:, 0, 0], stops_at), np.maximum(reach[:, 0, 1], stops_at)], axis=1)
    if straight or request.tail == "coast":
        line = np.zeros((1, request.joint_count, COEFFICIENTS))
        line[0, :, 0], line[0, :, 1] = arrival.positions, arrival.velocities
        trajectory = moving.then(Trajectory(np.array([0.0, straight]), line))
    if request.tail == "stop":
        final = np.zeros_like(stops_at) if straight else arrival.accelerations
        stop = fastest_stop(arrival.velocities, final, limits.accelerations, limits.jerks)
        trajectory, behind = trajectory.then(stop.trajectory(stops_at)), stop.reach(stops_at)
        reach = np.stack([np.minimum(reach, behind)[..., 0], np.maximum(reach, behind)[..., 1]], axis=2)
    return trajectory, reach


def _report(
    primitive: Primitive,
    request: MotionRequest,
    trajectory: Trajectory,
    hit: float,
    reach: np.ndarray,
    basis_count: int,
    by_limits: Distance,
) -> Report:
    """What the motion reaches and misses; nothing is certified."""
    goal, s = request.goal, np.linspace(0, 1, COMPARED)
    # The last instant belongs to the motion, not to its tail, whose acceleration may be another.
    played = trajectory.sample(np.minimum(s * hit, hit - 2 * ARRIVED))
    shown = primitive.sample(request.phase + (1 - request.phase) * s)
    at_hit = trajectory.sample(np.array([hit]))
    tau = (1 - request.phase) * primitive.duration / hit
    missed = played.accelerations - tau**2 * shown.accelerations
    return Report(
        imitation_rms=np.sqrt(simpson(missed**2, x=s, axis=0)),
        final_error_positions=np.abs(at_hit.positions[0] - goal.positions),
        final_error_velocities=np.abs(at_hit.velocities[0] - goal.velocities),
        extremes=by_quantity(reach),
        margin=by_quantity(margins(reach, request.limits)),
        active=(),
        from_demonstration=Distance.of((played.positions - shown.positions).T),
        by_limits=by_limits,
        phase=request.phase,
        basis_count=basis_count,
        certified=False,
        rounds=0,
        rows=0,
    )
