"""How a service takes its place on the bus, which only one process at a time may have, and keeps it."""

import contextlib
import logging
import threading
from collections.abc import Iterator

import zenoh

from protocol.bus.bus import CLAIM_PERIOD_S, Bus
from protocol.bus.sessions import DEFAULT_ENDPOINT, SERVICE, SessionTimeouts, session_config
from protocol.errors import NoAnswer
from services.common.cli import Options, open_bus
from services.common.realtime import EXIT_TAKEN
from services.common.tls_check import ANY_ADDRESS, listening

LOOKS_S = 0.0, 0.1, 1.0, 5.0
"""Waits before each look of a service whose session is back."""
TAKEN = "another %s serves robot %s on this bus"


@contextlib.contextmanager
def service_bus(
    service: str,
    options: Options,
    robot: str,
    stopping: threading.Event,
    log: logging.Logger,
    hosts: bool = False,
    patience: SessionTimeouts = SERVICE,
) -> Iterator[Bus]:
    """Open the bus as `service`, which only one process at a time may be; the bus is closed at the end.

    The service announces itself once it is ready. One whose session was lost, and who comes back to find another in
    its place, is told to stop within a question to the hub or two: until then, what both say to the arm is heard.

    Raises:
        SystemExit: 3 where another process is `service` already, or has become it; 1 where the bus is silent, cannot
            be hosted or would let in machines without a certificate; 0 where `stopping` was set before there was a
            hub to join.
    """
    bus = _join(service, options, robot, stopping, log, hosts, patience)
    displaced = threading.Event()

    def look_again() -> None:
        if _is_displaced(bus, service, stopping):
            log.error("%s; this one had lost its session, and ends", TAKEN % (service, bus.robot))
            displaced.set()
            stopping.set()

    with bus:
        bus.on_return(look_again)
        _take_place(bus, service, log)
        yield bus
    if displaced.is_set():
        raise SystemExit(EXIT_TAKEN)


def _join(
    service: str,
    options: Options,
    robot: str,
    stopping: threading.Event,
    log: logging.Logger,
    hosts: bool,
    patience: SessionTimeouts,
) -> Bus:
    """Open the bus.

    Raises:
        SystemExit: 3, 1 or 0, as above, once the log says why.
    """

    def give_up() -> bool:
        if not told:
            where = " ".join(options.connect) or options.zenoh_config or DEFAULT_ENDPOINT
            log.info("nobody hosts the bus at %s yet; waiting", where)
            told.append(True)
        return stopping.is_set()

    told: list[bool] = []
    try:
        return open_bus(options, robot, hosts, give_up, patience)
    except SystemExit as exposed:
        log.error("%s", exposed)
        raise SystemExit(1) from None
    except zenoh.ZError as error:
        if stopping.is_set():
            raise SystemExit(0) from None
        if hosts and _is_served(service, options, robot):
            log.error(TAKEN, service, options.robot or robot)
            raise SystemExit(EXIT_TAKEN) from None
        log.error("cannot open the bus: %s", error)
        raise SystemExit(1) from None


def _take_place(bus: Bus, service: str, log: logging.Logger) -> None:
    """Make sure that nobody else is `service`, nor becomes it at the same time.

    Raises:
        SystemExit: 3 where somebody is, 1 where the hub is silent, once the log says so.
    """
    try:
        alone = not bus.is_alive(service) and bus.claim(service)
    except NoAnswer as silence:
        log.error("%s; start again", silence)
        raise SystemExit(1) from None
    if not alone:
        log.error(TAKEN, service, bus.robot)
        raise SystemExit(EXIT_TAKEN)


def _is_displaced(bus: Bus, service: str, stopping: threading.Event) -> bool:
    """Whether another process is `service` now that this one's session is back.

    The hub's first answers may lack what others hold, and one that starts gives way in a moment: so several looks, and
    a rival has to be there twice.
    """
    for wait_s in LOOKS_S:
        if stopping.wait(wait_s):
            return False
        with contextlib.suppress(NoAnswer, zenoh.ZError):  # lost once more, stalled, or closed
            if bus.rivals(service) and not stopping.wait(CLAIM_PERIOD_S) and bus.rivals(service):
                return True
    return False


def _is_served(service: str, options: Options, robot: str) -> bool:
    """Whether `service` lives on the bus that could not be hosted because somebody hosts it already."""
    endpoints = options.listen or listening(session_config((), (), options.zenoh_config)) or (DEFAULT_ENDPOINT,)
    here = [endpoint.replace(ANY_ADDRESS, "127.0.0.1") for endpoint in endpoints]
    config = session_config(here, (), options.zenoh_config)
    config.insert_json5("transport/link/tls/verify_name_on_connect", "false")  # it is this machine, by no name
    for what in ("certificate", "private_key"):
        config.insert_json5(f"transport/link/tls/connect_{what}", config.get_json(f"transport/link/tls/listen_{what}"))
    try:
        with Bus(zenoh.open(config), options.robot or robot) as bus:
            return bus.is_alive(service)
    except zenoh.ZError:
        return False
