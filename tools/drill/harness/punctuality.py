"""The share of ticks that the controller answers in time, without load and under it."""

import time

from protocol import messages as m
from tools.drill.harness.cell import Cell
from tools.drill.scenario import Measured, at_least, at_most, reported, timed

ON_TIME = 95.0
"""%; a loop that is late more often without load is not measured under load."""


def on_time(cell: Cell, seconds: float) -> float:
    """Return the share of ticks that the controller answers in time over the coming `seconds`."""
    first = cell.status()
    time.sleep(seconds)
    return answered_since(first, cell)


def answered_since(first: m.Status, cell: Cell) -> float:
    """Return the share of ticks that the controller answered in time since a status."""
    last = cell.status()
    return 1.0 - (last.cycle.missed - first.cycle.missed) / max(1, cell.ticks(last.time - first.time))


def ratios(before: float, during: float) -> Measured:
    """Return the on-time ratios without load and under it, in percent, and their difference."""
    return {
        "on-time ratio without load": 100 * before,
        "on-time ratio under load": 100 * during,
        "lower under load by": 100 * (before - during),
    }


RATIOS = (
    timed(at_least("on-time ratio without load", ON_TIME, "%")),
    reported("on-time ratio under load", "%"),
    timed(at_most("lower under load by", 2.0, "%")),
)
