"""Command lines: flags of all services, and the services' own flags, which `python -m services` passes on."""

import errno
import itertools
import os
import socket
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from protocol.bus.bus import Bus
from protocol.bus.sessions import CLIENT, DEFAULT_ENDPOINT, SessionTimeouts, open_session, session_config
from protocol.messages import Clock
from protocol.topics import check_robot_name
from robot.schema import read_description
from robot.shipped import DEFAULT_ROBOT_CONFIG
from services.common.logs import LogForm
from services.common.tls_check import exposed_endpoints

EXPOSED = (
    "will not listen on {}: any machine could join there without a certificate and move the arm; "
    "listen on tcp/127.0.0.1:PORT, or start the sim by itself on tls/ADDRESS:PORT with --zenoh-config "
    "deploy/zenoh/router.json5 (docs/operations.md), or allow it with --insecure"
)
MISUSED = 2
"""Exit status for an invalid file or command line."""
OWN_PORTS = range(20_000, 30_000)
"""Ports that Linux does not assign automatically, so that one that is found free remains free until it is bound."""
_counter = itertools.count(os.getpid() * 61)  # processes that choose at the same time start at different ports
LIBRARIES = Path.home() / ".local" / "share" / "volley" / "library"
"""Default directory of the libraries, which has one directory a robot."""


def _shown_as(metavar: str) -> object:
    """Set the placeholder of a flag's value in the help, without a default that carries no information."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


OptionalFile = Annotated[Path | None, _shown_as("FILE")]
Endpoints = Annotated[tuple[str, ...], _shown_as("ENDPOINT ...")]


@dataclass(frozen=True, slots=True)
class Options:
    """Flags of one service.

    Attributes:
        robot: Name of the robot on the bus, the second part of every key; by default the one in the robot config.
        robot_config: TOML file of the robot; by default that of the shipped arm.
        connect: Endpoints of a router to join, tcp/HOST:PORT; by default tcp/127.0.0.1:7447, unless this service
            hosts the router.
        listen: Endpoints on which this service hosts the router.
        zenoh_config: Further Zenoh settings, a json5 file.
        insecure: Accept machines without a certificate; every machine that reaches the bus can then move the arm.
        loop_core: Core that sim and controller share and the other services avoid; by default the last one, unless the
            process may use only some of the machine's cores. Each arm on a machine needs its own core.
        log: Form of the log on stderr: text for a terminal, json for one object a line.
    """

    robot: Annotated[str | None, _shown_as("NAME")] = None
    robot_config: Annotated[Path, _shown_as("FILE")] = DEFAULT_ROBOT_CONFIG
    connect: Endpoints = ()
    listen: Endpoints = ()
    zenoh_config: OptionalFile = None
    insecure: bool = False
    loop_core: Annotated[int | None, _shown_as("N")] = None
    log: LogForm = "text"


def free_port(preferred: int = 0) -> int:
    """Return `preferred`, or another free loopback port if it is in use."""
    others = (OWN_PORTS[count % len(OWN_PORTS)] for count in _counter)
    return next(port for port in itertools.chain([preferred] if preferred else [], others) if _is_free(port))


def _is_free(port: int) -> bool:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        with suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return True
    return False


def free_endpoint() -> str:
    """Return a free endpoint on loopback."""
    return f"tcp/127.0.0.1:{free_port()}"


def is_taken(endpoint: str) -> bool:
    """Return whether another process listens on this TCP endpoint; False if that is unknown."""
    address = endpoint.partition("/")[2].partition("?")[0].partition("#")[0]
    host, _, port = address.rpartition(":")
    try:
        (family, *_, place), *_ = socket.getaddrinfo(host.strip("[]"), port, type=socket.SOCK_STREAM)
        with socket.socket(family) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(place)
    except OSError as error:
        return error.errno == errno.EADDRINUSE
    return False


def robot_name(options: Options) -> str:
    """Return the robot's name on the bus: the flag's, or the one in the robot config, whose model is not read.

    Raises:
        ValueError: the robot config, or the flag's name, cannot be used; the sentence says why.
    """
    description = read_description(options.robot_config)
    if options.robot is None:
        return description.name
    check_robot_name(options.robot)
    return options.robot


Common = Annotated[Options, tyro.conf.arg(name="")]
"""`Options` whose flags carry no prefix, for use as a field of a service's own flags."""


def open_bus(
    options: Options,
    robot: str,
    hosts_by_default: bool = False,
    give_up: Callable[[], bool] = lambda: False,
    timeouts: SessionTimeouts = CLIENT,
) -> Bus:
    """Open the bus of `robot` with `options`; without endpoints, host or join the default one.

    While there is no router to join, `give_up` is called twice a second. The peer applies `timeouts` to this process.

    Raises:
        zenoh.ZError: the configuration is invalid, an endpoint to listen on is taken, or `give_up` returned True.
        SystemExit: other machines could join without a certificate.
    """
    listen, connect = options.listen, options.connect
    if not listen and not connect and not options.zenoh_config:
        listen, connect = ((DEFAULT_ENDPOINT,), ()) if hosts_by_default else ((), (DEFAULT_ENDPOINT,))
    refuse_exposure(options, connect, listen)
    return Bus(open_session(connect, listen, options.zenoh_config, give_up, timeouts), options.robot or robot)


def refuse_exposure(options: Options, connect: Sequence[str], listen: Sequence[str]) -> None:
    """Raise SystemExit if a session with these endpoints accepts other machines without a certificate.

    Raises:
        zenoh.ZError: the configuration is invalid.
        SystemExit: the sentence names the endpoints and what would work.
    """
    exposed = exposed_endpoints(session_config(connect, listen, options.zenoh_config))
    if exposed and not options.insecure:
        raise SystemExit(EXPOSED.format(" ".join(exposed)))


@dataclass(frozen=True, slots=True)
class SimFlags:
    """Flags of the sim.

    Attributes:
        clock: paced follows the wall clock but waits for the controller, so that a slow machine only slows robot time;
            realtime does not wait, like a real arm; stepped advances on `sim/step` requests only.
        seed: Seed of the sensor noise; in stepped time it also names the first run.
        pace: With the clock paced: largest ratio of robot time to wall time; 0.25 gives processes four times as long.
        also: TOML files of further robots in the same model; one simulation moves them all, with one ball.
    """

    clock: Clock = "paced"
    seed: int = 0
    pace: float = 1.0
    also: Annotated[tuple[Path, ...], _shown_as("FILE ...")] = ()


@dataclass(frozen=True, slots=True)
class PlannerFlags:
    """Flags of the planner.

    Attributes:
        library: Directory of the learned primitives; by default ~/.local/share/volley/library/ROBOT. A new or
            empty one gets the demonstrations that are shipped for this arm.
        lead: Fixed time from now to the start of a plan, s; by default it follows the time that planning takes.
    """

    library: Annotated[Path | None, _shown_as("DIRECTORY")] = None
    lead: Annotated[float | None, _shown_as("S")] = None


@dataclass(frozen=True, slots=True)
class StrikerFlags:
    """Flags of the striker.

    Attributes:
        learned: File of the learned parameters of racket and ball, which persist between starts; by default
            ~/.local/share/volley/striker/ROBOT.json.
        method: Planning of swings: dmp is a movement primitive, for comparison; quintic is one polynomial without a
            demonstration, which the striker executes without the planner.
    """

    learned: OptionalFile = None
    method: Literal["qp", "dmp", "quintic"] = "qp"


@dataclass(frozen=True, slots=True)
class RecorderFlags:
    """Flags of the recorder.

    Attributes:
        record: Trace to write; an existing file is overwritten. By default volley-DATE-TIME.rrd in the current
            directory; with --live, `services.recorder` by itself writes none.
        unindexed: Leave out the index at the trace's end, for recordings of hours. Viewers need it to jump in the
            trace, and it takes 1 MB of memory a second. `rerun rrd optimize` adds it afterwards.
        live: Serve a live view on loopback, for `rerun` or a browser.
        live_port: Port of the live view.
    """

    record: OptionalFile = None
    unindexed: bool = False
    live: bool = False
    live_port: int = 9876
