"""Publications and logs of the controller."""

import logging
from collections.abc import Callable

from protocol import topics
from protocol.bus.bus import Bus
from services.controller.core import Controller

STATUS_PERIOD_NS = 20_000_000


class Publications:
    """Publishes commands, the status and results, and logs goals and faults.

    Attributes:
        commands: The publisher of commands.
    """

    def __init__(self, bus: Bus, core: Controller, log: logging.Logger, clock: Callable[[], int]) -> None:
        """Declare the publishers, not blocking; `clock` returns monotonic time, ns."""
        self._bus = bus
        self._core = core
        self._log = log
        self._clock = clock
        self._logged_fault: str | None = None
        self._next_status_ns = 0
        self.declare(blocking=False)

    def declare(self, blocking: bool) -> None:
        """Declare the publishers again; on a slow link they wait if `blocking`, and drop messages otherwise."""
        self.commands = self._bus.publisher(topics.COMMAND, blocking)
        self._status = self._bus.publisher(topics.STATUS, blocking)
        self._ended = self._bus.publisher(topics.ENDED, blocking)

    def report(self) -> None:
        """Publish the results that became final, and the status if it has changed or 20 ms have passed."""
        core = self._core
        for result in core.ledger.take_ended():
            self._ended.put(result)
            goal_id = result.goal_id
            self._log.info("goal %s %s %s", goal_id, result.outcome, result.reason, extra={"goal_id": goal_id})
        if core.fault != self._logged_fault:
            self._logged_fault = core.fault
            if core.fault:
                self._log.error("in fault: %s", core.fault, extra={"code": "fault"})
            else:
                self._log.info("out of the fault")
        now_ns = self._clock()
        if core.states.newest and (core.changed or now_ns >= self._next_status_ns):
            core.changed = False
            self._next_status_ns = now_ns + STATUS_PERIOD_NS
            self._status.put(core.status())
