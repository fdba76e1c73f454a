"""Log changes of the controller: silence, return, faults."""

import logging
from collections.abc import Callable

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from protocol.errors import Refusal

SILENT_S = topics.STATUS.max_age_s or 0.5


class ControllerWatch:
    """Receives every `status`; `update`, which must be called often, logs changes."""

    def __init__(self, bus: Bus, log: logging.Logger, pass_on: Callable[[m.Status], object]) -> None:
        """`pass_on` is called with each status on arrival, in Zenoh's thread."""
        self._log = log
        self._pass_on = pass_on
        self._newest: m.Status | None = None
        self._received_s = 0.0
        self._there = False
        self._fault: str | None = None
        bus.listen(topics.STATUS, self._receive)

    def _receive(self, body: bytes) -> None:
        try:
            status = decode(body, m.Status)
        except Refusal:
            return  # Noise is not a sign of life, and must not replace a status.
        self._newest = status
        self._pass_on(status)

    def update(self, now_s: float) -> None:
        """Log the changes up to `now_s`, on any monotonic clock."""
        status, self._newest = self._newest, None
        if status is not None:
            self._received_s = now_s
            self._note(status.fault)
        elif self._there and now_s - self._received_s > SILENT_S:
            self._there = False
            self._log.error("the controller fell silent; motions that it has accepted may have ended")

    def _note(self, fault: str | None) -> None:
        if not self._there:
            self._there = True
            self._log.info("the controller is there")
        if fault != self._fault:
            self._fault = fault
            if fault:
                self._log.error("the controller is in fault: %s", fault)
            else:
                self._log.info("the controller has left its fault")
