"""Run a single instance of a service: claim its name on the bus, serve, and end if another instance has it."""

import contextlib
import logging
import socket
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from hashlib import sha256

import zenoh

from protocol.bus.bus import CLAIM_PERIOD_S, Bus
from protocol.bus.sessions import DEFAULT_ENDPOINT, SERVICE, SessionTimeouts, session_config
from protocol.errors import NoAnswer
from services.common.cli import Options, open_bus
from services.common.tls_check import listening

RETURN_WAITS_S = 0.0, 0.1, 1.0, 5.0
"""Delays before each query for a rival after the session is back: a router's first replies may lack tokens."""


class Outcome(IntEnum):
    """Outcome of an instance, and exit status of its process.

    ENDED: it served until it was stopped, or was stopped before there was a router to join. FAILED: the bus cannot be
    opened, is silent, or would accept machines without a certificate. TAKEN: another instance has the name.
    """

    ENDED = 0
    FAILED = 1
    TAKEN = 3


@dataclass(frozen=True, slots=True)
class SingleInstance:
    """A service that may run once at a time on the bus of a robot.

    Attributes:
        service: Its name on the bus.
        options: Options of all services, with the endpoints.
        robot: Name of the robot, if the options have none.
        log: Receives the reason of an early end.
        hosts: Whether it hosts the router if the options name no endpoint to join.
        other_robots: Names of other robots for which it claims the same service.
        timeouts: Timeouts after which the peer of its session considers it lost.
    """

    service: str
    options: Options
    robot: str
    log: logging.Logger
    hosts: bool = field(default=False, kw_only=True)
    other_robots: Sequence[str] = field(default=(), kw_only=True)
    timeouts: SessionTimeouts = field(default=SERVICE, kw_only=True)

    def run(self, serve: Callable[[Bus], object], stopping: threading.Event) -> Outcome:
        """Open the bus, claim the name, call `serve` until it returns, and close the bus.

        While there is no router to join, wait for one until `stopping` is set. If the session expires and another
        instance takes over, this one sets `stopping` after one or two liveliness queries; until then both serve.
        """
        with _machine_lock(self._hosted_names()) as is_first:
            if not is_first:
                return self._taken()
            bus = self._open(stopping)
            if isinstance(bus, Outcome):
                return bus
            with bus:
                return self._serve(bus, serve, stopping)

    def _serve(self, bus: Bus, serve: Callable[[Bus], object], stopping: threading.Event) -> Outcome:
        displaced = threading.Event()
        places = [bus, *(Bus(bus.session, robot) for robot in self.other_robots)]

        def look_for_rival() -> None:
            if any(self._is_displaced(place, stopping) for place in places):
                displaced.set()
                stopping.set()

        bus.on_return(look_for_rival)
        try:
            for place in places:
                if place.is_alive(self.service) or not place.claim(self.service):
                    return self._taken(robot=place.robot)
        except NoAnswer as silence:
            self.log.error("%s; start again", silence)
            return Outcome.FAILED
        serve(bus)
        return self._taken("; this one had lost its session, and ends") if displaced.is_set() else Outcome.ENDED

    def _open(self, stopping: threading.Event) -> Bus | Outcome:
        """Open the bus, or log the reason of the failure."""
        where = " ".join(self.options.connect) or self.options.zenoh_config or DEFAULT_ENDPOINT
        waiting = threading.Event()

        def give_up() -> bool:
            if not waiting.is_set():
                waiting.set()
                self.log.info("nobody hosts the bus at %s yet; waiting", where)
            return stopping.is_set()

        try:
            return open_bus(self.options, self.robot, self.hosts, give_up, self.timeouts)
        except SystemExit as exposed:
            self.log.error("%s", exposed)
        except zenoh.ZError as error:
            if stopping.is_set():
                return Outcome.ENDED
            self.log.error("cannot open the bus: %s", error)
        return Outcome.FAILED

    def _taken(self, consequence: str = "", robot: str = "") -> Outcome:
        self.log.error("another %s serves robot %s on this bus%s", self.service, robot or self._name, consequence)
        return Outcome.TAKEN

    def _is_displaced(self, bus: Bus, stopping: threading.Event) -> bool:
        """Return whether another process has claimed the name, after this one's session is back.

        A starting instance may yield shortly after, so a rival counts only if it is found twice.
        """
        for wait_s in RETURN_WAITS_S:
            if stopping.wait(wait_s):
                return False
            with contextlib.suppress(NoAnswer, zenoh.ZError):  # lost once more, stalled, or closed
                if bus.rivals(self.service) and not stopping.wait(CLAIM_PERIOD_S) and bus.rivals(self.service):
                    return True
        return False

    @property
    def _name(self) -> str:
        return self.options.robot or self.robot

    def _hosted_names(self) -> list[str]:
        """Return the names of the machine's locks: this service at each endpoint on which it hosts."""
        options = self.options
        if not self.hosts or options.connect:
            return []
        configured: list[str] = []
        with contextlib.suppress(zenoh.ZError):  # invalid; logged when the bus is opened
            configured = listening(session_config((), (), options.zenoh_config))
        endpoints = options.listen or configured or (DEFAULT_ENDPOINT,)
        return [f"{self.service} of {self._name} at {endpoint}" for endpoint in endpoints]


@contextlib.contextmanager
def _machine_lock(names: Iterable[str]) -> Iterator[bool]:
    """Hold locks of these names, and yield whether no other process of this machine holds any of them.

    A port in use does not reveal its owner. A lock is an abstract Unix socket: it is in the same network namespace as
    the port, and the kernel removes it with the process, even if that is killed.
    """
    with contextlib.ExitStack() as held:
        try:
            for name in names:
                lock = held.enter_context(socket.socket(socket.AF_UNIX))
                lock.bind(f"\0volley {sha256(name.encode()).hexdigest()}")
            free = True
        except OSError:
            free = False
        yield free
