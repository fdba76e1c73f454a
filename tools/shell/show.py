"""Replies as tables and sentences for a person; units stand in the headers."""

import time
from collections.abc import Sequence
from functools import singledispatch
from itertools import pairwise

from msgspec import Struct
from rich.console import Group, RenderableType
from rich.text import Text

from protocol import messages as m
from tools.shell.tables import cell, joint_table, sentence, table

OUTCOME_STYLES = {
    "succeeded": "green",
    "missed": "red",
    "running": "cyan",
    "preempted": "yellow",
    "canceled": "yellow",
    "aborted": "red",
}
MODE_STYLES = {"holding": "green", "tracking": "cyan", "stopping": "yellow", "fault": "bold red"}
UNITS = {"positions": "rad", "velocities": "rad/s", "accelerations": "rad/s²", "jerks": "rad/s³"}


@singledispatch
def show(reply: Struct, names: Sequence[str]) -> RenderableType:
    """Return what to print for a reply; `names` of the joints, empty where they are not known."""
    fields = [(name, getattr(reply, name)) for name in reply.__struct_fields__ if name != "version"]
    return sentence(*(f"{name} {value}" for name, value in fields))


@show.register
def _(reply: m.GoalReply, names: Sequence[str]) -> RenderableType:
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
    quantities = [(f"{name} [{unit}]", getattr(report.extremes, name)) for name, unit in UNITS.items()]
    joints = [("imitation rms [rad/s²]", report.imitation_rms), *quantities]
    if report.torque_use is not None:
        joints.append(("torque [of limit]", report.torque_use))
    margins = [(f"{name} [{unit}]", getattr(report.margin, name)) for name, unit in UNITS.items()]
    tables = [
        joint_table(names, joints, "extremes, the stop included"),
        joint_table(names, margins, "distance to limits, the stop included"),
    ]
    if reply.positions:
        ends = [("position [rad]", reply.positions), ("velocity [rad/s]", reply.velocities)]
        tables.insert(
            0,
            joint_table(
                names,
                [*ends, *_deviations(report.deviation)],
                "at the goal; deviation from the demonstration, and the part that the limits cause",
            ),
        )
    active = [f"{a.quantity} of {a.joint} at {a.time_from_start:.3f} s" for a in report.active]
    free = "no limit shapes the motion up to the hit"
    shaped = sentence(f"shaped by the limits on {', '.join(active)}" if active else free)
    return Group(head, solved, *tables, shaped, sentence(_space(report)))


def _space(report: m.Report) -> str:
    """What was found of collisions and torques."""
    if report.checked == "none":
        return "NOT checked for collisions and torques"
    part = "checked only in PART for collisions and torques, as time ran out; " if report.checked == "part" else ""
    near = report.clearance
    if near is None:
        return part + "no distance was measured"
    nearest = f"{near.body} comes nearest to {near.other}: {cell(near.distance)} m at {near.time_from_start:.3f} s"
    return part + nearest


def _deviations(deviation: m.Deviation | None) -> list[tuple[str, Sequence[object]]]:
    """Columns of how far the plan is from the demonstration, and how much of that the limits do."""
    if deviation is None:
        return []
    kinds = ("deviation", deviation.from_demonstration), ("by limits", deviation.by_limits)
    return [(f"{kind} {name} [rad]", getattr(distance, name)) for kind, distance in kinds for name in ("rms", "max")]


@show.register
def _(reply: m.Result, names: Sequence[str]) -> RenderableType:
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
    """How far the hit threw the arm off, and when it was back."""
    back = f"{recoil.back_time:.3f} s" if recoil.back_time is not None else "not yet"
    peak = f"recoil {cell(recoil.peak_error)} rad at {recoil.peak_time:.3f} s"
    return f"{peak}, within {recoil.tolerance:g} rad again: {back}"


def _stages(stamps: m.Stamps) -> str:
    """How long each stage took, of those that were reached."""
    reached = [(name, getattr(stamps, name)) for name in stamps.__struct_fields__ if getattr(stamps, name) is not None]
    steps = [f"{name.replace('_', ' ')} {(at - before) / 1e6:.1f} ms" for (_, before), (name, at) in pairwise(reached)]
    return f"after the request: {', then '.join(steps)}" if steps and stamps.requested is not None else ""


@show.register
def _(reply: m.Status, names: Sequence[str]) -> RenderableType:
    cycle = reply.cycle
    fault = f"{reply.fault}; leave it with: volley reset" if reply.fault else ""
    mode = sentence(reply.mode, f"goal {reply.goal_id}" if reply.goal_id else "", clock(reply), fault)
    mode.stylize(MODE_STYLES[reply.mode], 0, len(reply.mode))
    columns = [
        ("reference [rad]", reply.reference.positions),
        ("measured [rad]", reply.feedback.positions),
        ("error [rad]", reply.error.positions),
        ("reference [rad/s]", reply.reference.velocities),
        ("measured [rad/s]", reply.feedback.velocities),
        ("error [rad/s]", reply.error.velocities),
    ]
    loop = sentence(
        f"{cycle.count} ticks answered",
        f"{100 * cycle.on_time_ratio:.2f} % on time",
        f"{cycle.missed} missed",
        f"answer in {cycle.late_us.p50:.0f}/{cycle.late_us.p99:.0f}/{cycle.late_us.max:.0f} µs (median/99 %/worst)",
        f"{cycle.refused} refused" if cycle.refused else "",
    )
    return Group(mode, joint_table(names, columns), loop)


def clock(status: m.Status) -> str:
    """Return where the robot's clock and the motion stand."""
    into = f", {status.time_from_start:.3f} s into the motion" if status.time_from_start is not None else ""
    return f"at {status.time:.3f} s{into}"


@show.register
def _(reply: m.State, names: Sequence[str]) -> RenderableType:
    head = sentence(
        f"tick {reply.tick} of run {reply.run}",
        f"{reply.time:.3f} s",
        f"applied the answer to tick {reply.applied_tick}" if reply.applied_tick >= 0 else "no command applied yet",
        "" if reply.condition == "ready" else f"{reply.condition.upper()} {reply.reason}".strip(),
    )
    columns: list[tuple[str, Sequence[object]]] = [
        ("position [rad]", reply.positions),
        ("velocity [rad/s]", reply.velocities),
        ("torque [N·m]", reply.torques),
        ("clipped", reply.saturated),
    ]
    if reply.truth:
        columns += [("true position [rad]", reply.truth.positions), ("true velocity [rad/s]", reply.truth.velocities)]
    held = sentence(*(f"{name} held at {cell(value)}" for name, value in reply.held.items()))
    return Group(head, joint_table(names, columns), *([held] if reply.held else []))


@show.register
def _(reply: m.Reference, names: Sequence[str]) -> RenderableType:
    columns = [(f"{name} [{UNITS[name]}]", getattr(reply, name)) for name in list(UNITS)[:3]]
    played = f"goal {reply.goal_id}" if reply.goal_id else ""
    return Group(sentence(f"at {reply.time:.3f} s", f"epoch {reply.epoch}", played), joint_table(names, columns))


@show.register
def _(reply: m.Description, names: Sequence[str]) -> RenderableType:
    head = sentence(
        f"{len(reply.joint_names)} joints",
        f"{reply.rate_hz:.0f} Hz",
        f"{reply.clock} clock",
        f"run {reply.run}",
        f"the ball is seen at {reply.ball_rate_hz:.0f} Hz" if reply.ball_rate_hz else "",
    )
    quantities = [(f"{name} [{unit}]", getattr(reply.limits, name)) for name, unit in UNITS.items()]
    columns = [("home [rad]", reply.home), *quantities, ("torques [N·m]", reply.limits.torques)]
    return Group(head, joint_table(reply.joint_names, columns, "limits"))


@show.register
def _(reply: m.Primitives, names: Sequence[str]) -> RenderableType:
    if not reply.primitives:
        return sentence("the library is empty; fill it with: volley learn FILE")
    made = table(("name", "joints", "duration [s]", "samples", "created"))
    for entry in reply.primitives:
        created = time.strftime("%Y-%m-%d %H:%M", time.localtime(entry.created))
        made.add_row(entry.name, str(entry.joint_count), f"{entry.duration:.3f}", str(entry.samples), created)
    return made


@show.register
def _(reply: m.Learned, names: Sequence[str]) -> RenderableType:
    head = sentence(
        f"learned {reply.name}",
        f"{reply.duration:.3f} s",
        f"{reply.samples} samples" if reply.samples else "",
        f"{reply.basis_count} functions a joint",
        _smoothing(reply.smoothing),
    )
    errors = [
        ("position error rms [rad]", reply.position_rms),
        ("position error max [rad]", reply.position_max),
        ("acceleration error rms [rad/s²]", reply.fit_rms),
        ("noise [rad]", reply.noise_estimate),
    ]
    tables = [joint_table(names, [(header, values) for header, values in errors if values], "what was learned")]
    if reply.start and reply.goal:
        ends = ("start", reply.start), ("goal", reply.goal)
        columns = [
            (f"{end} [{UNITS[name]}]", getattr(at, name)) for end, at in ends for name in ("positions", "velocities")
        ]
        tables.append(joint_table(names, columns, "where it begins and ends"))
    return Group(head, *tables, *(Text(f"warning: {warning}", style="yellow") for warning in reply.warnings))


def _smoothing(used: m.SavitzkyGolay | None) -> str:
    """The filter, empty for a penalised spline and for no smoothing, whose replies are the same."""
    if used is None:
        return ""
    return f"smoothed over {used.window_s:g} s, order {used.order}"


@show.register
def _(reply: m.Forgotten, names: Sequence[str]) -> RenderableType:
    return sentence(f"forgot {reply.name}")


@show.register
def _(reply: m.Accepted, names: Sequence[str]) -> RenderableType:
    return sentence(f"goal {reply.goal_id}", f"starts at {reply.start_time:.3f} s")


@show.register
def _(reply: m.Canceled, names: Sequence[str]) -> RenderableType:
    if reply.goal_id is None:
        return sentence("nothing moves")
    return sentence(f"stopping goal {reply.goal_id}", f"at rest at {reply.stop_time:.3f} s")


@show.register
def _(reply: m.Recovered, names: Sequence[str]) -> RenderableType:
    return sentence(f"the arm is {reply.condition.replace('_', ' ')}", f"run {reply.run}")


@show.register
def _(reply: m.Guided, names: Sequence[str]) -> RenderableType:
    return sentence(f"the arm is {reply.condition.replace('_', ' ')}")


@show.register
def _(reply: m.Held, names: Sequence[str]) -> RenderableType:
    targets = ", ".join(f"{name} to {cell(value)}" for name, value in reply.joints.items())
    there = "" if reply.arrival_time is None else f"there at {reply.arrival_time:.3f} s"
    return sentence(f"leading {targets}", there)


@show.register
def _(reply: m.ModeReply, names: Sequence[str]) -> RenderableType:
    return sentence(f"the controller is {reply.mode}")


@show.register
def _(reply: m.Stepped, names: Sequence[str]) -> RenderableType:
    return sentence(f"tick {reply.tick}", f"{reply.time:.3f} s")


@show.register
def _(reply: m.ResetDone, names: Sequence[str]) -> RenderableType:
    return sentence(f"run {reply.run} begins", f"tick {reply.tick}")


@show.register
def _(reply: m.Disturbed, names: Sequence[str]) -> RenderableType:
    return sentence(f"disturbs from {reply.start_time:.3f} s on")


@show.register
def _(reply: m.Thrown, names: Sequence[str]) -> RenderableType:
    return sentence(f"the ball flies from {reply.time:.3f} s on")


@show.register
def _(reply: m.Striking, names: Sequence[str]) -> RenderableType:
    return sentence("the striker returns balls" if reply.active else "the striker strikes no further ball")
