"""A goal's reply and result as tables and sentences."""

from collections.abc import Sequence
from itertools import pairwise

from rich.console import Group, RenderableType

from protocol import messages as m
from tools.shell.tables import by_quantity, cell, joint_table, sentence

OUTCOME_STYLES = {
    "succeeded": "green",
    "missed": "red",
    "running": "cyan",
    "preempted": "yellow",
    "canceled": "yellow",
    "aborted": "red",
}


def goal_reply(reply: m.GoalReply, names: Sequence[str]) -> RenderableType:
    """Return a goal's plan: times, solver statistics, tables of extremes and margins."""
    report = reply.report
    head = sentence(
        f"goal {reply.goal_id}",
        f"plays alternative {reply.alternative}" if reply.alternative else "",
        f"goes on at phase {report.phase:.3f} of the demonstration" if report.phase else "",
        f"starts at {reply.start_time:.3f} s",
        f"hits at {reply.start_time + reply.duration:.3f} s ({reply.duration:.3f} s later)",
        f"rests at {reply.start_time + reply.total_duration:.3f} s",
    )
    solved = sentence(
        f"planned in {report.solve_ms:.1f} ms",
        f"{report.rounds} rounds, {report.rows} rows",
        f"{report.basis_count} functions a joint" if report.basis_count else "",
        "inside all limits at all times" if report.certified else "limits are NOT certified between samples",
    )
    joints = [("imitation rms [rad/s²]", report.imitation_rms), *by_quantity(report.extremes)]
    if report.torque_use is not None:
        joints.append(("torque [of limit]", report.torque_use))
    tables = [
        joint_table(names, joints, "extremes, the stop included"),
        joint_table(names, by_quantity(report.margin), "distance to limits, the stop included"),
    ]
    if reply.positions:
        ends = [*by_quantity(reply, ("positions", "velocities")), *_deviations(report.deviation)]
        title = "at the goal; deviation from the demonstration, and the part that the limits cause"
        tables.insert(0, joint_table(names, ends, title))
    active = ", ".join(f"{a.quantity} of {a.joint} at {a.time_from_start:.3f} s" for a in report.active)
    shaped = sentence(f"shaped by the limits on {active}" if active else "no limit shapes the motion up to the hit")
    return Group(head, solved, *tables, shaped, sentence(_space(report)))


def _space(report: m.Report) -> str:
    """Describe the checks for collisions and torques."""
    if report.checked == "none":
        return "NOT checked for collisions and torques"
    part = "checked only in PART for collisions and torques, as time ran out; " if report.checked == "part" else ""
    near = report.clearance
    if near is None:
        return part + "no distance was measured"
    nearest = f"{near.body} comes nearest to {near.other}: {cell(near.distance)} m at {near.time_from_start:.3f} s"
    return part + nearest


def _deviations(deviation: m.Deviation | None) -> list[tuple[str, Sequence[object]]]:
    """Columns of the plan's deviation from the demonstration, and of the part that the limits cause."""
    if deviation is None:
        return []
    kinds = ("deviation", deviation.from_demonstration), ("by limits", deviation.by_limits)
    return [(f"{kind} {name} [rad]", getattr(distance, name)) for kind, distance in kinds for name in ("rms", "max")]


def result(reply: m.Result, names: Sequence[str]) -> RenderableType:
    """Return a goal's result: outcome, errors at the hit, events during the motion."""
    head = sentence(f"goal {reply.goal_id}", reply.outcome, reply.reason)
    head.highlight_words([reply.outcome], OUTCOME_STYLES[reply.outcome])
    lines: list[RenderableType] = [head]
    if reply.hit:
        columns = [
            ("position error [rad]", reply.hit.position_error),
            ("velocity error [rad/s]", reply.hit.velocity_error),
        ]
        if reply.hit.truth_error:
            columns.append(("true position error [rad]", reply.hit.truth_error.positions))
            columns.append(("true velocity error [rad/s]", reply.hit.truth_error.velocities))
        lines.append(joint_table(names, columns, f"at the hit, {reply.hit.time:.3f} s"))
    elif reply.outcome != "running":
        lines.append(sentence("the hit was not reached"))
    touch = reply.first_contact
    lines.append(
        sentence(
            f"largest tracking error {cell(reply.peak_tracking_error)} rad",
            f"torques clipped for {reply.saturated_ticks} ticks" if reply.saturated_ticks else "",
            f"{touch.body} touched {touch.other} at {touch.time:.3f} s" if touch else "",
            _recoil(reply.recoil) if reply.recoil else "",
        )
    )
    if stages := _stages(reply.stamps):
        lines.append(sentence(stages))
    return Group(*lines)


def _recoil(recoil: m.Recoil) -> str:
    """Describe the recoil: peak error after the hit, and the time at which the arm was back."""
    back = f"{recoil.back_time:.3f} s" if recoil.back_time is not None else "not yet"
    peak = f"recoil {cell(recoil.peak_error)} rad at {recoil.peak_time:.3f} s"
    return f"{peak}, within {recoil.tolerance:g} rad again: {back}"


def _stages(stamps: m.Stamps) -> str:
    """Durations of the stages that were reached."""
    reached = [(name, getattr(stamps, name)) for name in stamps.__struct_fields__ if getattr(stamps, name) is not None]
    steps = [f"{name.replace('_', ' ')} {(at - before) / 1e6:.1f} ms" for (_, before), (name, at) in pairwise(reached)]
    return f"after the request: {', then '.join(steps)}" if steps and stamps.requested is not None else ""
