"""Motions that are replaced or canceled at every tenth."""

import msgspec
import numpy as np

from protocol import messages as m
from protocol import topics
from tools.drill.harness.cell import Cell, refusal_code
from tools.drill.harness.commanded import CommandedMotion
from tools.drill.harness.lab import Lab
from tools.drill.scenario import Measured, Scenario, at_most, exactly, none

TENTHS = range(11)
SMOOTH = (
    at_most("largest acceleration step, fraction of the jerk limit", 1.001),
    at_most("largest integration error of the positions, fraction of the bound", 1.001),
    at_most("largest command, fraction of its limit", 1.000001),
)


def largest(motions: list[CommandedMotion]) -> Measured:
    """Return the largest values of several motions, which `SMOOTH` bounds; NaN if one of them is NaN."""
    values = [(motion.jerk_used(), motion.integration_error(), motion.limits_used()) for motion in motions]
    return dict(zip((bound.reaction for bound in SMOOTH), np.max(values, axis=0).tolist(), strict=True))


def strike_into(cell: Cell, tenth: int) -> m.GoalReply:
    """Begin a strike in a new run and step to `tenth` tenths of its duration."""
    cell.reset()
    reply = cell.strike()
    cell.step_to(cell.ticks(reply.start_time + tenth / 10 * reply.duration) + 2)
    return reply


def preempt(lab: Lab) -> Measured:
    """Replace a strike by another goal at every tenth."""
    cell, motions = lab.shared_cell(), []
    wrong = failed = 0
    for tenth in TENTHS:
        first = strike_into(cell, tenth)
        second = cell.goal(duration=0.7)
        failed += cell.finish(second).outcome != "succeeded"
        hit = second.start_time >= first.start_time + first.duration
        wrong += cell.result(first.goal_id).outcome != ("succeeded" if hit else "preempted")
        motions.append(CommandedMotion(cell.commands(), cell.config))
    return {"replaced goals with a wrong outcome": wrong, "new goals that failed": failed, **largest(motions)}


def cancel(lab: Lab) -> Measured:
    """Cancel a strike at every tenth; a plan that is in flight then arrives afterwards."""
    cell, motions = lab.shared_cell(), []
    wrong = moving = 0
    codes = set()
    for tenth in TENTHS:
        reply = strike_into(cell, tenth)
        flying = cell.goal(duration=0.7, plan_only=True, include_trajectory=True).trajectory
        assert flying is not None
        stop = cell.bus.ask(topics.CANCEL, m.Cancel())
        executed = msgspec.structs.replace(flying, goal_id=f"in flight {cell.run}")
        codes.add(refusal_code(lambda plan=executed: cell.bus.ask(topics.EXECUTE, plan)))
        cell.step_to(cell.ticks(stop.stop_time) + 2)
        wrong += cell.result(reply.goal_id).outcome != "canceled"
        moving += any(cell.commands()[-1].velocities)
        motions.append(CommandedMotion(cell.commands(), cell.config))
    return {
        "canceled goals with a wrong outcome": wrong,
        "refusal codes of the plans in flight": ", ".join(sorted(codes)),
        "references in motion at the stop time": moving,
        **largest(motions),
    }


SCENARIOS = (
    Scenario(
        "preempt",
        "a new goal at every tenth of a strike",
        (none("replaced goals with a wrong outcome"), none("new goals that failed"), *SMOOTH),
        preempt,
    ),
    Scenario(
        "cancel",
        "a cancel at every tenth of a strike, with a plan in flight",
        (
            none("canceled goals with a wrong outcome"),
            exactly("refusal codes of the plans in flight", "superseded"),
            none("references in motion at the stop time"),
            *SMOOTH,
        ),
        cancel,
    ),
)
