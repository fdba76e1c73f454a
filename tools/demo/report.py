"""Table of the demo's strikes."""

from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from protocol import messages as m
from tools.demo.play import StrikeOutcome

SLOW = 0.95
"""Ratio of robot time to wall time below which the report calls the machine slow."""


def table(outcomes: list[StrikeOutcome], joint_names: Sequence[str]) -> Table:
    """Return a table with one row for each strike."""
    shown = Table(title="Five strikes from one demonstration", box=SIMPLE_HEAD, padding=0)
    shown.add_column("strike", no_wrap=True)
    for heading in ("plan\ns", "solve\nms", "off by\nmrad", "off by\nmrad/s", "ball\nm/s", "unlike\nrad/s²"):
        shown.add_column(heading, justify="right", no_wrap=True)
    shown.add_column("closest limit", min_width=14)
    shown.add_column("result", no_wrap=True, min_width=6)
    shown.caption = "off by: true error at the hit, worst joint; unlike: acceleration minus the demonstration's, rms"
    for outcome in outcomes:
        report = outcome.reply.report
        position, velocity = outcome.true_errors() if outcome.result.hit else (float("nan"), float("nan"))
        imitation = (sum(rms**2 for rms in report.imitation_rms) / len(report.imitation_rms)) ** 0.5
        verdict = Text("missed", "bold red") if outcome.failures() else Text("kept", "green")
        shown.add_row(
            outcome.strike.title,
            f"{outcome.reply.duration:.2f}",
            f"{report.solve_ms:.1f}",
            f"{1e3 * position:.3f}",
            f"{1e3 * velocity:.3f}",
            f"{outcome.ball_speed:.1f}",
            f"{imitation:.2f}",
            closest_limit(report, joint_names),
            verdict,
        )
    return shown


def speed(outcomes: list[StrikeOutcome], cycle: m.Cycle) -> str:
    """Return a sentence about the ratio of robot time to wall time and the controller's latency."""
    ratio = sum(outcome.robot_s for outcome in outcomes) / sum(outcome.wall_s for outcome in outcomes)
    cost = " (the machine is slow or busy; the results do not depend on it)" if ratio < SLOW else ""
    return (
        f"robot time ran at {ratio:.2f} of the wall clock{cost}; an answer of the controller took "
        f"{cycle.late_us.p50:.0f} µs in the median, {cycle.late_us.p99:.0f} µs at the 99th percentile"
    )


def closest_limit(report: m.Report, joint_names: Sequence[str]) -> str:
    """Return the plan's active limits, or its closest limit if none is active.

    Jerk is omitted, because the stop after the hit always uses the full jerk.
    """
    shaping = sorted({f"{active.joint} {active.quantity}" for active in report.active if active.quantity != "jerk"})
    if shaping:
        return ", ".join(shaping) + ": reached"
    used = []
    for quantity, field in (("position", "positions"), ("velocity", "velocities"), ("acceleration", "accelerations")):
        extremes, margins = getattr(report.extremes, field), getattr(report.margin, field)
        for joint, (lowest, highest), margin in zip(joint_names, extremes, margins, strict=True):
            if margin is not None:
                reach = max(abs(lowest), abs(highest))
                used.append((reach / (reach + margin), f"{joint} {quantity}"))
    fraction, name = max(used)
    return f"{name} {fraction:.0%}"
