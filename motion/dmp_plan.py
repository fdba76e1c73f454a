"""A motion planned with the DMP of eq. 6–7 instead of the quadratic program: nothing keeps its limits.

So its report says by how much it leaves them, and `check_limits` refuses it.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy

from motion.basis import INTERVALS
from motion.dmp import learn_dmp
from motion.errors import InvalidMotion, LimitExceeded
from motion.limits import QUANTITIES
from motion.primitive import Primitive
from motion.report import Report
from motion.request import MotionRequest
from motion.samples import Samples
from motion.tail import stop

MAX_STOP_S = 100.0
"""A longer stop is not sampled."""

ROUNDING = 1e-6
"""A limit counts as left beyond this part of its range, as in the certificate of a plan."""


@dataclass(frozen=True, slots=True, eq=False)
class DmpPlan:
    """A motion of eq. 6–7 with its tail; the fields are those of `motion.plan.Plan`."""

    request: MotionRequest
    duration: float
    total_duration: float
    hit_index: int
    report: Report
    motion: Samples

    def samples(self) -> Samples:
        """States on the tick grid, the first at 0, the last at `total_duration` (with a tail "stop" at rest)."""
        return self.motion


def plan_dmp(primitive: Primitive, request: MotionRequest, tick: float = 0.001) -> DmpPlan:
    """Plan with eq. 6–7, learned afresh from the demonstration that `primitive` was learned from.

    The duration is rounded to ticks. A start's acceleration is the first sample's; from it the motion jumps
    to the DMP's own within one tick. The tail stops from the state that was reached, which is not exactly
    the goal. Limits are not looked at but for the tail's jerk and acceleration. Raises InvalidMotion for what
    a DMP cannot do: way-points, a rest fraction, a given final acceleration; and for a stop of more than 100 s.
    """
    _refuse_what_it_cannot(primitive, request)
    moving = learn_dmp(primitive).rollout(request.start, request.goal, request.duration, tick, "trapezium")
    motion = moving if request.tail == "coast" else _with_stop(moving, request, tick)
    hit_index = len(moving) - 1
    return DmpPlan(
        request=request,
        duration=hit_index * tick,
        total_duration=(len(motion) - 1) * tick,
        hit_index=hit_index,
        report=_report(primitive, request, motion, hit_index, tick),
        motion=motion,
    )


def check_limits(plan: DmpPlan) -> None:
    """Raises LimitExceeded for the first limit that the plan leaves."""
    for quantity, name in enumerate(QUANTITIES):
        for joint, (lowest, highest) in enumerate(plan.report.extremes[name]):
            low, high = plan.request.limits.ranges[joint, quantity]
            slack = ROUNDING * (high - low) if np.isfinite(high - low) else 0.0
            if lowest < low - slack:
                raise LimitExceeded(joint, name, float(lowest), float(low))
            if highest > high + slack:
                raise LimitExceeded(joint, name, float(highest), float(high))


def _refuse_what_it_cannot(primitive: Primitive, request: MotionRequest) -> None:
    if primitive.joint_count != request.joint_count:
        raise InvalidMotion("primitive", f"moves {primitive.joint_count} joints, the request {request.joint_count}")
    remedy = "a DMP has no such thing; leave it out or use method 'qp'"
    if request.waypoints:
        raise InvalidMotion("waypoints", f"has {len(request.waypoints)} entries; {remedy}")
    if request.rest_fraction > 0:
        raise InvalidMotion("rest_fraction", f"is {request.rest_fraction}; {remedy}")
    if not np.isnan(request.goal.accelerations).all():
        raise InvalidMotion("goal.accelerations", f"is given; {remedy}")


def _with_stop(moving: Samples, request: MotionRequest, tick: float) -> Samples:
    """The motion and, from where it arrives, the jerk-limited stop."""
    tail = stop(moving.positions[-1], moving.velocities[-1], moving.accelerations[-1], request.limits)
    if tail.duration > MAX_STOP_S:
        raise InvalidMotion("limits", f"make the stop take {tail.duration:.0f} s; at most {MAX_STOP_S:.0f} s are taken")
    count = math.ceil(tail.duration / tick - 1e-9)
    stopping = tail.sample(np.arange(1, count + 1) * tick)
    return Samples(
        *(
            np.concatenate([getattr(part, name) for part in (moving, stopping)])
            for name in ("positions", "velocities", "accelerations")
        )
    )


def _report(primitive: Primitive, request: MotionRequest, motion: Samples, hit: int, tick: float) -> Report:
    """What the samples say. Jerk is the difference of accelerations a tick apart. Never certified: nothing was
    shown of the time between samples."""
    jerks = np.diff(motion.accelerations, axis=0) / tick
    values = motion.positions, motion.velocities, motion.accelerations, jerks
    extremes = np.stack([np.stack([v.min(axis=0), v.max(axis=0)], axis=1) for v in values])
    ranges = request.limits.ranges.transpose(1, 0, 2)
    margin = np.minimum(extremes[..., 0] - ranges[..., 0], ranges[..., 1] - extremes[..., 1])
    return Report(
        imitation_rms=imitation_rms(primitive, motion.accelerations[: hit + 1], request.duration),
        final_error_positions=np.abs(motion.positions[hit] - request.goal.positions),
        final_error_velocities=np.abs(motion.velocities[hit] - request.goal.velocities),
        extremes=dict(zip(QUANTITIES, extremes, strict=True)),
        margin=dict(zip(QUANTITIES, margin, strict=True)),
        active=(),
        certified=False,
        rounds=0,
        rows=0,
    )


def imitation_rms(primitive: Primitive, accelerations: np.ndarray, duration: float) -> np.ndarray:
    """Rms (J,) of g̈ − τ²d̈ with τ = T_d/T for accelerations (n, J) equally spaced over the motion, rad/s²."""
    s = np.linspace(0, 1, len(accelerations))
    grid = np.linspace(0, 1, INTERVALS + 1)
    demonstrated = scipy.interpolate.make_interp_spline(grid, primitive.accelerations, k=3)(s)
    tau = primitive.duration / duration
    return np.sqrt(scipy.integrate.simpson((accelerations - tau**2 * demonstrated) ** 2, x=s, axis=0))
