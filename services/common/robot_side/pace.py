"""The pace of the wall clock, for a loop that may run slower."""

import logging
import time

from services.common.realtime import Deadlines

REPORT_S = 5.0
SLOW = 0.95
"""Robot time over wall time below which the machine is called slow."""


class Pace:
    """Lets a tick begin no sooner than the wall clock says, and warns where robot time falls behind it."""

    def __init__(self, rate_hz: float, log: logging.Logger) -> None:
        """`rate_hz`: ticks a second of wall time."""
        self._deadlines = Deadlines(round(1e9 / rate_hz))
        self._log = log
        self.restart()

    def restart(self) -> None:
        """Measure from now on: what was lost so far is not the machine's fault."""
        self._ticks, self._began = 0, time.monotonic()

    def wait(self) -> None:
        """Sleep until the next tick may begin."""
        self._deadlines.wait()
        self._ticks += 1
        passed = time.monotonic() - self._began
        if passed >= REPORT_S:
            ratio = self._ticks * self._deadlines.period_ns * 1e-9 / passed
            if ratio < SLOW:
                self._log.warning("robot time runs at %.2f of its pace: this machine is slow", ratio)
            self.restart()
