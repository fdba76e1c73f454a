"""Convert plans to messages."""

import math
from typing import Any

import numpy as np
from msgspec import UNSET

from motion.plan import SplinePlan
from motion.primitive import Primitive
from motion.program.report import Distance, Report
from motion.request import Waypoint
from protocol import messages as m
from protocol.codec import matrix_bytes
from protocol.errors import Refusal
from protocol.topics import legible
from robot.conversions import finite_or_null, limit_fields, sample_matrices
from robot.description import RobotConfig
from robot.motion_check import Findings
from services.planner.library import SHOWN
from services.planner.solving import Made

ROUNDING = 1e-9

_FIELDS = {"positions": "position", "velocities": "velocity", "accelerations": "acceleration", "jerks": "jerk"}

SAMPLED_S = 20.0
"""Longest motion, s, that is sent with one sample a tick; a longer one is sent with every nth sample."""


def executed_message(made: Made, goal: m.Goal, goal_id: str, config: RobotConfig, stamps: m.Stamps) -> m.Trajectory:
    """Return the trajectory for the controller: polynomials, or samples if the method has no polynomials."""
    frame = _frame(made, goal, goal_id, config, stamps)
    if isinstance(made.plan, SplinePlan):
        return m.Trajectory(**frame, pieces=_pieces(made.plan))
    return m.Trajectory(**frame, **sample_matrices(made.plan.samples()))


def sampled_message(made: Made, goal: m.Goal, goal_id: str, config: RobotConfig, stamps: m.Stamps) -> m.Trajectory:
    """Return the motion as samples; a long one has every nth sample, and its polynomials if it has them."""
    frame, plan = _frame(made, goal, goal_id, config, stamps), made.plan
    every = max(1, math.ceil(plan.total_duration / SAMPLED_S - ROUNDING))
    count = math.ceil((frame["count"] - 1) / every) + 1
    frame |= {"dt": every * config.tick, "count": count, "hit_index": round(plan.hit_index / every)}
    if every > 1 and isinstance(plan, SplinePlan):
        frame["pieces"] = _pieces(plan)
    return m.Trajectory(**frame, **sample_matrices(plan.sample(np.arange(count) * every * config.tick)))


def _pieces(plan: SplinePlan) -> m.Pieces:
    motion = plan.trajectory
    return m.Pieces(breaks=motion.breaks.tolist(), coefficients=matrix_bytes(motion.coefficients))


def _frame(made: Made, goal: m.Goal, goal_id: str, config: RobotConfig, stamps: m.Stamps) -> dict[str, Any]:
    """Return a trajectory's fields other than the motion itself."""
    return {
        "goal_id": goal_id,
        "client_id": goal.client_id,
        "lease": goal.lease,
        "preempt": goal.preempt,
        "epoch": made.origin.epoch,
        "joint_names": list(config.joint_names),
        "start_time": made.origin.time,
        "dt": config.tick,
        "count": round(made.plan.total_duration / config.tick) + 1,
        "hit_index": made.plan.hit_index,
        "stamps": stamps,
        "tolerance": UNSET if goal.tolerance is None else goal.tolerance,
    }


def goal_reply(made: Made, goal_id: str, trajectory: m.Trajectory | None, config: RobotConfig) -> m.GoalReply:
    """Return the reply to a goal, with the `trajectory` if given."""
    plan = made.plan
    return m.GoalReply(
        goal_id=goal_id,
        start_time=made.origin.time,
        duration=plan.duration,
        total_duration=plan.total_duration,
        positions=plan.request.goal.positions.tolist(),
        velocities=plan.request.goal.velocities.tolist(),
        alternative=made.alternative,
        trajectory=trajectory,
        report=_report(made, config),
    )


def plan_message(made: Made, trajectory: m.Trajectory, goal: m.Goal, primitive: Primitive) -> m.Plan:
    """Return the publication of an accepted plan: its samples, primitive, waypoints and limits."""
    fields = {name: getattr(trajectory, name) for name in m.Trajectory.__struct_fields__ if name != "version"}
    phase = made.plan.report.phase
    s = phase + (1 - phase) * np.linspace(0.0, 1.0, trajectory.hit_index + 1)
    return m.Plan(
        **fields,
        primitive=goal.primitive,
        revises=goal.revises,
        phase=phase,
        limits=m.PlanLimits(**limit_fields(made.plan.request.limits)),
        waypoints=[_waypoint(waypoint) for waypoint in made.plan.request.waypoints],
        torque_use=_torque_use(made.findings),
        clearance=_clearance(made.findings),
        demonstration=matrix_bytes(primitive.positions(s)),
    )


def _waypoint(waypoint: Waypoint) -> m.Waypoint:
    """Return a waypoint in joint space, also for a goal in tool space."""
    states = waypoint.positions, waypoint.velocities
    positions, velocities = (finite_or_null(state) if np.isfinite(state).any() else None for state in states)
    return m.Waypoint(time_from_start=float(waypoint.time_from_start), positions=positions, velocities=velocities)


def refused_message(goal: m.Goal | None, goal_id: str | None, refusal: Refusal, requested_ns: int) -> m.Refused:
    """Return the publication of a refused goal; the goal and its id are None if its body was not decoded.

    Its texts are truncated, because their length may be the reason of the refusal.
    """
    return m.Refused(
        goal_id=goal_id,
        client_id=legible(goal.client_id) if goal else "",
        primitive=legible(goal.primitive[:SHOWN]) if goal else "",
        code=refusal.code,
        message=refusal.message,
        detail=refusal.detail,
        requested=requested_ns,
    )


def _report(made: Made, config: RobotConfig) -> m.Report:
    report: Report = made.plan.report
    return m.Report(
        imitation_rms=report.imitation_rms.tolist(),
        deviation=m.Deviation(
            from_demonstration=_distance(report.from_demonstration), by_limits=_distance(report.by_limits)
        ),
        phase=float(report.phase),
        basis_count=int(report.basis_count),
        final_error=m.FinalError(
            positions=report.final_error_positions.tolist(), velocities=report.final_error_velocities.tolist()
        ),
        extremes=m.Extremes(**{name: list(map(tuple, report.extremes[key].tolist())) for name, key in _FIELDS.items()}),
        margin=m.Margin(**{name: finite_or_null(report.margin[key]) for name, key in _FIELDS.items()}),
        active=[
            m.ActiveLimit(
                joint=config.joint_names[active.joint],
                quantity=active.quantity,
                time_from_start=float(active.time_from_start),
            )
            for active in report.active
        ],
        certified=bool(report.certified),
        checked=made.findings.scope,
        torque_use=_torque_use(made.findings),
        clearance=_clearance(made.findings),
        solve_ms=made.solve_ms,
        rounds=int(report.rounds),
        rows=int(report.rows),
    )


def _torque_use(findings: Findings) -> list[float | None] | None:
    return None if findings.torque_use is None else finite_or_null(findings.torque_use)


def _clearance(findings: Findings) -> m.Clearance | None:
    near = findings.nearest
    if near is None:
        return None
    return m.Clearance(distance=near.distance, body=near.body, other=near.other, time_from_start=near.time)


def _distance(distance: Distance) -> m.Distance:
    return m.Distance(rms=distance.rms.tolist(), max=distance.max.tolist())
