"""The command-line flags that every service shares."""

import logging
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
import zenoh

from protocol.bus import Bus
from protocol.errors import NoAnswer
from protocol.sessions import DEFAULT_ENDPOINT, LEASE_MS, SERVICE_LEASE_MS, open_session, session_config
from services.exposure import ANY_ADDRESS, exposed_endpoints, listening
from services.logs import LogForm
from services.runtime import EXIT_TAKEN

EXPOSED = (
    "will not listen on {}: any machine could join there without a certificate, and whoever joins can move the arm; "
    "listen on tcp/127.0.0.1:PORT, or start the sim by itself on tls/ADDRESS:PORT with --zenoh-config "
    "deploy/zenoh/router.json5 (docs/operations.md), or allow it with --insecure"
)
TAKEN = "another %s serves robot %s on this bus"
DEFAULT_ROBOT_CONFIG = Path(__file__).resolve().parent.parent / "deploy" / "robots" / "arm.toml"


@dataclass(frozen=True, slots=True)
class Options:
    """Flags of one service.

    Attributes:
        robot: Name of the robot on the bus, the second part of every key; by default the one in the robot config.
        robot_config: TOML file beside an MJCF file that describes the robot.
        connect: Endpoints of the bus to join, as tcp/HOST:PORT. By default tcp/127.0.0.1:7447, unless this
            service hosts the bus.
        listen: Endpoints on which this service hosts the bus.
        zenoh_config: Further Zenoh settings, a json5 file.
        insecure: Let machines in that show no certificate; whoever reaches the bus can move the arm.
        log: What services log on stderr: text for a terminal, json for one object a line.
    """

    robot: str | None = None
    robot_config: Path = DEFAULT_ROBOT_CONFIG
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    zenoh_config: Path | None = None
    insecure: bool = False
    log: LogForm = "text"


def free_endpoint() -> str:
    """Return an endpoint on loopback that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


Common = Annotated[Options, tyro.conf.arg(name="")]
"""`Options` whose flags carry no prefix, for use as a field of a service's own flags."""


def open_bus(
    options: Options,
    robot: str,
    hosts_by_default: bool = False,
    give_up: Callable[[], bool] = lambda: False,
    lease_ms: int = LEASE_MS,
) -> Bus:
    """Open the bus of `robot` as `options` say; without endpoints the service hosts or joins the default one.

    While the hub to join is not there, `give_up` is asked twice a second: a service passes its stop event's `is_set`.

    Raises:
        zenoh.ZError: the configuration is invalid, an endpoint to listen on is taken, or `give_up` said so.
        SystemExit: the service would let in other machines without asking for a certificate.
    """
    listen, connect = options.listen, options.connect
    if not listen and not connect and not options.zenoh_config:
        listen, connect = ((DEFAULT_ENDPOINT,), ()) if hosts_by_default else ((), (DEFAULT_ENDPOINT,))
    refuse_exposure(options, connect, listen)
    return Bus(open_session(connect, listen, options.zenoh_config, give_up, lease_ms), options.robot or robot)


def refuse_exposure(options: Options, connect: Sequence[str], listen: Sequence[str]) -> None:
    """Return where a session with these endpoints asks every other machine for a certificate, or need not.

    Raises:
        zenoh.ZError: the configuration is invalid.
        SystemExit: it would not ask; the sentence names the endpoints and what would work.
    """
    exposed = exposed_endpoints(session_config(connect, listen, options.zenoh_config))
    if exposed and not options.insecure:
        raise SystemExit(EXPOSED.format(" ".join(exposed)))


@contextmanager
def service_bus(
    service: str, options: Options, robot: str, stopping: threading.Event, log: logging.Logger, hosts: bool = False
) -> Iterator[Bus]:
    """Open the bus as `service`, which only one process at a time may be; the bus is closed at the end.

    The service announces itself once it is ready.

    Raises:
        SystemExit: 3 where another process is `service` already, 1 where the bus is silent, cannot be hosted or would
            let in machines without a certificate, 0 where `stopping` was set before there was a hub to join.
    """

    def give_up() -> bool:
        if not told:
            where = " ".join(options.connect) or options.zenoh_config or DEFAULT_ENDPOINT
            log.info("nobody hosts the bus at %s yet; waiting", where)
            told.append(True)
        return stopping.is_set()

    told: list[bool] = []
    try:
        bus = open_bus(options, robot, hosts, give_up, SERVICE_LEASE_MS)
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
    with bus:
        _take_place(bus, service, log)
        yield bus


def _take_place(bus: Bus, service: str, log: logging.Logger) -> None:
    """Make sure that nobody else is `service`, nor becomes it at the same time."""
    try:
        alone = not bus.is_alive(service) and bus.claim(service)
    except NoAnswer as silence:
        log.error("%s; start again", silence)
        raise SystemExit(1) from None
    if not alone:
        log.error(TAKEN, service, bus.robot)
        raise SystemExit(EXIT_TAKEN)


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
