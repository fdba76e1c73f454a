"""Detect requests that were sent as `put` instead of `get`."""

import logging

from protocol.bus.bus import Bus
from services.common.logs import ThrottledLog


class StrayPuts:
    """Warns about requests that were sent as `put`, which have no effect and no reply."""

    def __init__(self, bus: Bus, log: logging.Logger) -> None:
        self._bus = bus
        self._log = ThrottledLog(log)

    def warn(self) -> None:
        """Warn about messages since the last call."""
        for key in self._bus.take_puts():
            self._log.warn(f"something was put on {key} and did nothing; send a request as a query: get, not put")
