"""The on-time ratio: the fraction of ticks that the controller answers in time, without load and under load."""

import time

from protocol import messages as m
from tools.drill.harness.cell import Cell
from tools.drill.scenario import Measured, at_least, at_most, reported, timed

LEAST_PERCENT = 95.0
"""Least on-time ratio without load, %; a measurement under load is meaningless below it."""


def measure_ratio(cell: Cell, seconds: float) -> float:
    """Return the on-time ratio over the next `seconds`."""
    first = cell.status()
    time.sleep(seconds)
    return ratio_since(first, cell)


def ratio_since(first: m.Status, cell: Cell) -> float:
    """Return the on-time ratio since a status."""
    last = cell.status()
    return 1.0 - (last.cycle.missed - first.cycle.missed) / max(1, cell.ticks(last.time - first.time))


def load_ratios(before: float, during: float) -> Measured:
    """Return the measurements that `LOAD_RATIOS` bounds, from the ratios before and during the load."""
    return {
        "on-time ratio without load": 100 * before,
        "on-time ratio under load": 100 * during,
        "decrease under load": 100 * (before - during),
    }


LOAD_RATIOS = (
    timed(at_least("on-time ratio without load", LEAST_PERCENT, "%")),
    reported("on-time ratio under load", "%"),
    timed(at_most("decrease under load", 2.0, "%")),
)
