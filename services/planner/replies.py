"""From a plan to what goes over the wire."""

import numpy as np

from motion.dmp_plan import DmpPlan
from motion.limits import Limits
from motion.plan import Plan, Report
from motion.primitive import Primitive
from protocol import messages as m
from protocol.codec import matrix_bytes
from protocol.errors import Refusal
from protocol.topics import MAX_ID
from services.planner.goals import Origin
from services.planner.library import SHOWN
from services.robot import RobotConfig

_FIELDS = {"positions": "position", "velocities": "velocity", "accelerations": "acceleration", "jerks": "jerk"}


def trajectory_message(
    plan: Plan | DmpPlan, goal: m.Goal, goal_id: str, origin: Origin, config: RobotConfig, stamps: m.Stamps
) -> m.Trajectory:
    """Return the sampled plan."""
    samples = plan.samples()
    return m.Trajectory(
        goal_id=goal_id,
        client_id=goal.client_id,
        lease=goal.lease,
        preempt=goal.preempt,
        epoch=origin.epoch,
        joint_names=list(config.joint_names),
        start_time=origin.time,
        dt=config.tick,
        count=len(samples),
        hit_index=plan.hit_index,
        positions=matrix_bytes(samples.positions),
        velocities=matrix_bytes(samples.velocities),
        accelerations=matrix_bytes(samples.accelerations),
        stamps=stamps,
    )


def goal_reply(
    plan: Plan | DmpPlan,
    goal_id: str,
    start_time: float,
    trajectory: m.Trajectory | None,
    solve_ms: float,
    config: RobotConfig,
) -> m.GoalReply:
    """Return the answer to a goal, with the `trajectory` if it is given."""
    return m.GoalReply(
        goal_id=goal_id,
        start_time=start_time,
        duration=plan.duration,
        total_duration=plan.total_duration,
        trajectory=trajectory,
        report=_report(plan.report, solve_ms, config),
    )


def plan_message(plan: Plan | DmpPlan, trajectory: m.Trajectory, goal: m.Goal, primitive: Primitive) -> m.Plan:
    """Return the accepted plan with what it was made of."""
    fields = {name: getattr(trajectory, name) for name in m.Trajectory.__struct_fields__ if name != "version"}
    s = np.linspace(0.0, 1.0, plan.hit_index + 1)
    return m.Plan(
        **fields,
        primitive=goal.primitive,
        limits=limits_message(plan.request.limits),
        waypoints=goal.waypoints,
        demonstration=matrix_bytes(primitive.demonstrated_positions(s)),
    )


def refused_message(goal: m.Goal | None, goal_id: str | None, refusal: Refusal, requested_ns: int) -> m.Refused:
    """Return what is published of a refused goal; it and its id are None where its body did not decode.

    Its words are cut, for they may be what it is refused for.
    """
    return m.Refused(
        goal_id=goal_id,
        client_id=goal.client_id[:MAX_ID] if goal else "",
        primitive=goal.primitive[:SHOWN] if goal else "",
        code=refusal.code,
        message=refusal.message,
        detail=refusal.detail,
        requested=requested_ns,
    )


def limits_message(limits: Limits) -> m.PlanLimits:
    """Return limits with null where there is none."""
    return m.PlanLimits(
        positions=[tuple(pair) if np.isfinite(pair).all() else None for pair in limits.positions.tolist()],
        velocities=_finite(limits.velocities),
        accelerations=_finite(limits.accelerations),
        jerks=_finite(limits.jerks),
    )


def _report(report: Report, solve_ms: float, config: RobotConfig) -> m.Report:
    return m.Report(
        imitation_rms=report.imitation_rms.tolist(),
        final_error=m.FinalError(
            positions=report.final_error_positions.tolist(), velocities=report.final_error_velocities.tolist()
        ),
        extremes=m.Extremes(**{name: list(map(tuple, report.extremes[key].tolist())) for name, key in _FIELDS.items()}),
        margin=m.Margin(**{name: _finite(report.margin[key]) for name, key in _FIELDS.items()}),
        active=[
            m.ActiveLimit(
                joint=config.joint_names[active.joint],
                quantity=active.quantity,
                time_from_start=float(active.time_from_start),
            )
            for active in report.active
        ],
        certified=bool(report.certified),
        solve_ms=solve_ms,
        rounds=int(report.rounds),
        rows=int(report.rows),
    )


def _finite(values: np.ndarray) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]
