"""Start a cell, which is the services of one robot on a bus, and wait until it is ready."""

import contextlib
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import SERVICE
from protocol.errors import NoAnswer, Refusal
from services.common.cli import Options, free_endpoint, open_bus, robot_name
from services.common.supervisor import READY_S, NotReady, Supervisor, command_lines

Wrap = Callable[[str, list[str]], list[str]]


@dataclass(frozen=True, slots=True)
class RunningCell:
    """A cell's processes, a session on its bus that survives stalls of this process, and endpoints for clients."""

    services: Supervisor
    bus: Bus
    endpoint: str


@contextlib.contextmanager
def running_cell(
    options: Options = Options(),  # noqa: B008  immutable
    flags: Mapping[str, object] | None = None,
    names: Sequence[str] | None = None,
    *,
    logs: Path | None = None,
    quiet: bool = False,
    wrap: Wrap = lambda _, line: line,
    give_up: Callable[[], bool] = lambda: False,
) -> Iterator[RunningCell]:
    """Start the services, wait until the arm accepts goals, and end them with the block.

    Without an endpoint in `options` the router listens on a free port. Without a `library` in `flags` the planner has
    a temporary one.

    Args:
        options: Options of all services: robot, endpoints, form of the log.
        flags: Values of the services' own flags by name.
        names: The services to start; by default those of the process table that are not optional.
        logs: Directory for the services' logs; by default they go to stderr, or nowhere if `quiet`.
        quiet: Do not log to stderr.
        wrap: Returns, for a service's name and command line, the command line to start instead.
        give_up: Called 20 times a second; returns True to stop waiting.

    Raises:
        NotReady: a service ended, or did not become ready in time; the sentence names it and the reason.
        ValueError: the robot config cannot be read.
        zenoh.ZError: the bus cannot be joined, or `give_up` returned True before it existed.
    """
    if not options.listen and not options.connect:
        options = replace(options, listen=(free_endpoint(),))
    reach = replace(options, listen=(), connect=options.connect or options.listen)
    robot = robot_name(options)
    with contextlib.ExitStack() as stack:
        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="volley-")))
        lines = command_lines(options, {"library": scratch / "library", **(flags or {})}, names)
        lines = {name: wrap(name, line) for name, line in lines.items()}
        services = stack.enter_context(Supervisor(lines, logs or (scratch if quiet else None)))

        def check() -> bool:
            services.check_running()
            return give_up()

        bus = stack.enter_context(open_bus(reach, robot, give_up=check, timeouts=SERVICE))
        services.wait_ready(bus, give_up=give_up)
        if {"sim", "controller"} <= set(lines):
            _wait_for_controller(bus, check)
        yield RunningCell(services, bus, reach.connect[0])


def _wait_for_controller(bus: Bus, give_up: Callable[[], bool]) -> None:
    """Wait until the controller has detected the arm, or `give_up` returns True.

    Raises:
        NotReady: the controller has not detected the arm within `READY_S`.
    """
    deadline = time.monotonic() + READY_S
    while not give_up():
        with contextlib.suppress(Refusal, NoAnswer):
            bus.ask(topics.STATUS_QUERY, m.Empty())
            return
        if time.monotonic() > deadline:
            raise NotReady(f"the controller did not detect the arm within {READY_S:.0f} s")
        time.sleep(0.05)
