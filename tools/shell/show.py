"""Replies as tables and sentences for people; the headers contain the units."""

import time
from collections.abc import Callable, Sequence
from functools import singledispatch
from typing import Any

from msgspec import Struct
from rich.console import Group, RenderableType
from rich.text import Text

from protocol import messages as m
from tools.shell import show_goal
from tools.shell.tables import UNITS, by_quantity, cell, joint_table, sentence, table

MODE_STYLES = {"holding": "green", "tracking": "cyan", "stopping": "yellow", "fault": "bold red"}


def _stopping(reply: m.Canceled) -> Sequence[str]:
    if reply.goal_id is None:
        return ["nothing was stopped", f"at rest at {reply.stop_time:.3f} s"]
    return [f"stopping goal {reply.goal_id}", f"at rest at {reply.stop_time:.3f} s"]


def _leading(reply: m.Held) -> Sequence[str]:
    targets = ", ".join(f"{name} to {cell(value)}" for name, value in reply.joints.items())
    return [f"leading {targets}", "" if reply.arrival_time is None else f"there at {reply.arrival_time:.3f} s"]


def _words(condition: m.Condition) -> str:
    return condition.replace("_", " ")


SENTENCES: dict[type[Struct], Callable[[Any], Sequence[str]]] = {
    m.Forgotten: lambda reply: [f"forgot {reply.name}"],
    m.Accepted: lambda reply: [f"goal {reply.goal_id}", f"starts at {reply.start_time:.3f} s"],
    m.Canceled: _stopping,
    m.Recovered: lambda reply: [f"the arm is {_words(reply.condition)}", f"run {reply.run}"],
    m.Guided: lambda reply: [f"the arm is {_words(reply.condition)}"],
    m.Held: _leading,
    m.ModeReply: lambda reply: [f"the controller is {reply.mode}"],
    m.Stepped: lambda reply: [f"tick {reply.tick}", f"{reply.time:.3f} s"],
    m.ResetDone: lambda reply: [f"run {reply.run} begins", f"tick {reply.tick}"],
    m.Disturbed: lambda reply: [f"disturbs from {reply.start_time:.3f} s on"],
    m.Thrown: lambda reply: [f"the ball flies from {reply.time:.3f} s on"],
    m.Striking: lambda reply: ["the striker returns balls" if reply.active else "the striker strikes no further ball"],
}
"""Parts of the sentence for each reply that needs no table."""


@singledispatch
def show(reply: Struct, names: Sequence[str]) -> RenderableType:
    """Return what to print for a reply; `names` are the joints', empty if unknown."""
    return sentence(*SENTENCES[type(reply)](reply))


show.register(show_goal.goal_reply)
show.register(show_goal.result)


@show.register
def _(reply: m.Status, names: Sequence[str]) -> RenderableType:
    cycle = reply.cycle
    cure = "leave it with: volley reset, or volley recover if the arm is not ready"
    fault = f"{reply.fault}; {cure}" if reply.fault else ""
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
    """Return the robot's time and the time since the motion's start."""
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
    columns = by_quantity(reply, ("positions", "velocities", "accelerations"))
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
    columns = [("home [rad]", reply.home), *by_quantity(reply.limits), ("torques [N·m]", reply.limits.torques)]
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
    """Describe the filter; empty for a penalised spline and for no smoothing, which have the same reply."""
    return "" if used is None else f"smoothed over {used.window_s:g} s, order {used.order}"
