"""Motions replaced and canceled at every tenth of the way."""

import msgspec
import numpy as np

from protocol import messages as m
from protocol import topics
from tools.drill.harness.cell import Cell, code_of
from tools.drill.harness.commanded import Reference
from tools.drill.harness.lab import Lab
from tools.drill.scenario import Measured, Scenario, at_most, exactly, none

TENTHS = range(11)
SMOOTH = (
    at_most("steps of acceleration used", 1.001),
    at_most("steps of position used", 1.001),
    at_most("limits used", 1.000001),
)


class Worst:
    """The worst of several references."""

    def __init__(self) -> None:
        self.jerk = self.gap = self.limits = 0.0

    def note(self, cell: Cell) -> None:
        """Take in the run so far."""
        reference = Reference(cell.commands(), cell.config)
        # Unlike Python's, numpy's maximum keeps what is not a number.
        self.jerk = float(np.maximum(self.jerk, reference.jerk_used()))
        self.gap = float(np.maximum(self.gap, reference.unexplained()))
        self.limits = float(np.maximum(self.limits, reference.limits_used()))

    def measured(self) -> Measured:
        """Return what `SMOOTH` bounds."""
        return {
            "steps of acceleration used": self.jerk,
            "steps of position used": self.gap,
            "limits used": self.limits,
        }


def strike_into(cell: Cell, tenth: int) -> m.GoalReply:
    """Begin a strike in a new run and step to a tenth of its way."""
    cell.reset()
    reply = cell.strike()
    cell.step_to(cell.ticks(reply.start_time + tenth / 10 * reply.duration) + 2)
    return reply


def preempt(lab: Lab) -> Measured:
    """Replace a strike by a goal at every tenth."""
    cell, worst = lab.shared(), Worst()
    untold = failed = 0
    for tenth in TENTHS:
        first = strike_into(cell, tenth)
        second = cell.goal(duration=0.7)
        failed += cell.finish(second).outcome != "succeeded"
        hit = second.start_time >= first.start_time + first.duration
        untold += cell.result(first.goal_id).outcome != ("succeeded" if hit else "preempted")
        worst.note(cell)
    return {"old goals not told": untold, "new goals that fail": failed, **worst.measured()}


def cancel(lab: Lab) -> Measured:
    """Cancel a strike at every tenth, each time with a plan in flight that arrives afterwards."""
    cell, worst = lab.shared(), Worst()
    untold = moving = 0
    codes = set()
    for tenth in TENTHS:
        reply = strike_into(cell, tenth)
        flying = cell.goal(duration=0.7, plan_only=True, include_trajectory=True).trajectory
        assert flying is not None
        stop = cell.bus.ask(topics.CANCEL, m.Cancel())
        executed = msgspec.structs.replace(flying, goal_id=f"in flight {cell.run}")
        codes.add(code_of(lambda plan=executed: cell.bus.ask(topics.EXECUTE, plan)))
        cell.step_to(cell.ticks(stop.stop_time) + 2)
        untold += cell.result(reply.goal_id).outcome != "canceled"
        moving += any(cell.commands()[-1].velocities)
        worst.note(cell)
    return {
        "old goals not told": untold,
        "plans in flight refused as": ", ".join(sorted(codes)),
        "references still moving at the stop time": moving,
        **worst.measured(),
    }


SCENARIOS = (
    Scenario(
        "preempt",
        "a new goal at every tenth of a strike",
        "stepped",
        (none("old goals not told"), none("new goals that fail"), *SMOOTH),
        preempt,
    ),
    Scenario(
        "cancel",
        "a cancel at every tenth of a strike, with a plan in flight",
        "stepped",
        (
            none("old goals not told"),
            exactly("plans in flight refused as", "superseded"),
            none("references still moving at the stop time"),
            *SMOOTH,
        ),
        cancel,
    ),
)
