"""Limits in force: a plan's while it is played, otherwise the robot's."""

from collections.abc import Sequence

import numpy as np

from protocol import messages as m
from robot.conversions import limit_fields
from services.recorder.context import Context
from services.recorder.entities import LIMITS
from services.recorder.writer import Rows

Limits = dict[str, np.ndarray]
"""By quantity (J, 2): lowest and highest, NaN for no limit."""

REPEAT_S = 1.0
"""Period with which unchanged limits are written again, s, so that a view of a few seconds shows them."""


class LimitsInForce:
    """Writes limits when they change, and once a second in between."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._robot = limits_by_quantity(m.PlanLimits(**limit_fields(context.config.limits)))
        self._limits: Limits | None = None
        self._tick = -1

    def change(self, tick: int, limits: Limits | None) -> None:
        """Write the limits that hold from `tick` on; None: the robot's."""
        self._write(tick, self._robot if limits is None else limits)

    def write_until(self, newest: int) -> None:
        """Write the robot's limits if none are in force yet, and those in force if a second has passed."""
        if self._limits is None:
            oldest = self._context.state_times.oldest
            self.change(newest if oldest is None else oldest, None)
        elif newest - self._tick >= REPEAT_S * self._context.rate_hz:
            self._write(newest, self._limits)

    def _write(self, tick: int, limits: Limits) -> None:
        self._limits, self._tick = limits, tick
        row = Rows([tick], self._context.rate_hz)
        for quantity, bounds in limits.items():
            for name, pair in zip(self._context.names, bounds, strict=True):
                if np.isfinite(pair).all():
                    self._context.trace.scalars(LIMITS[quantity].at(name), row, pair[None])


def limits_by_quantity(limits: m.PlanLimits) -> Limits:
    """Return limits in the form in which they are written."""
    return {
        "position": _rows(limits.positions),
        "velocity": _rows(limits.velocities),
        "acceleration": _rows(limits.accelerations),
    }


def _rows(bounds: Sequence[m.Range | float | None]) -> np.ndarray:
    """Return (J, 2) of pairs, symmetric bounds, or none (NaN)."""
    return np.array([_pair(bound) for bound in bounds], dtype=float)


def _pair(bound: m.Range | float | None) -> tuple[float, float]:
    if bound is None:
        return np.nan, np.nan
    return (-bound, bound) if isinstance(bound, int | float) else (bound[0], bound[1])
