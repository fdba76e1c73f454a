"""Limit a loop to the pace of the wall clock; it may run slower."""

import logging
import time

from services.common.realtime import Deadlines

REPORT_S = 5.0
SLOW = 0.95
"""Ratio of robot time to wall time below which a warning calls the machine slow."""


class Pace:
    """Delays ticks to the pace of the wall clock, and warns if robot time falls behind."""

    def __init__(self, rate_hz: float, log: logging.Logger) -> None:
        """`rate_hz`: ticks a second of wall time."""
        self._deadlines = Deadlines(round(1e9 / rate_hz))
        self._log = log
        self.restart()

    def restart(self) -> None:
        """Restart the measurement: earlier delays were not caused by the machine."""
        self._ticks, self._began = 0, time.monotonic()

    def wait(self) -> None:
        """Sleep until the next tick may start."""
        self._deadlines.wait()
        self._ticks += 1
        passed = time.monotonic() - self._began
        if passed >= REPORT_S:
            ratio = self._ticks * self._deadlines.period_ns * 1e-9 / passed
            if ratio < SLOW:
                self._log.warning("robot time runs at %.2f of its pace: this machine is slow", ratio)
            self.restart()
