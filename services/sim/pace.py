"""The clock `paced`: lock-step with the controller, no faster than the wall clock."""

import logging
import time
from collections.abc import Callable

from services.common.realtime import Deadlines

HANG_S = 2.0
"""A controller that answers a tick no sooner is no longer waited for."""
REPORT_S = 5.0
SLOW = 0.95
"""Robot time over wall time below which the machine is called slow."""


class Partner:
    """Whether there is a controller to wait for: from its liveliness token until that is lost.

    One that hangs is not waited for either, until its next command. `wake` is called, in Zenoh's thread, once the token
    appears or is lost.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._alive = False
        self._hangs = False
        self._since = time.monotonic()

    def see(self, _: str, alive: bool) -> None:
        """Note that the token is there, or is lost."""
        self._alive, self._since = alive, time.monotonic()
        self._wake()

    def ask(self) -> None:
        """Note that a state was published, which the controller has yet to answer."""
        self._since = time.monotonic()

    def hear(self) -> None:
        """Note a command."""
        self._hangs = False

    def starts_to_hang(self) -> bool:
        """Return True once, where the answer is overdue by now."""
        begins = self.is_awaited and time.monotonic() > self._since + HANG_S
        self._hangs |= begins
        return begins

    @property
    def is_awaited(self) -> bool:
        """Whether time must stand still until the controller has answered."""
        return self._alive and not self._hangs


class Pace:
    """Lets a tick begin no sooner than the wall clock says, and warns where robot time falls behind it."""

    def __init__(self, rate_hz: float, log: logging.Logger) -> None:
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
                self._log.warning("robot time runs at %.2f of the wall clock: this machine is slow", ratio)
            self.restart()
