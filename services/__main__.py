"""`python -m services`: everything with one robot, until Ctrl-C."""

import contextlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Annotated

import tyro
import zenoh
from rich.console import Console

from deploy.processes import PROCESSES
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import DEFAULT_ENDPOINT
from protocol.errors import NoAnswer, Refusal
from services.common import realtime, web_viewer
from services.common.cell import RunningCell, running_cell
from services.common.cli import (
    MISUSED,
    Common,
    Options,
    PlannerFlags,
    RecorderFlags,
    SimFlags,
    StrikerFlags,
    free_port,
    is_taken,
    open_bus,
    refuse_exposure,
    robot_name,
)
from services.common.signals import stop_on_signals
from services.common.supervisor import NotReady, ending

Unprefixed = tyro.conf.arg(name="")
WEB_PORT = 9090
LOOK_S = 1.0
"""How long to ask which robot has taken an endpoint."""


@dataclass(frozen=True, slots=True)
class Flags:
    """Start every service with one robot and keep them until Ctrl-C.

    Writes a trace, volley-DATE-TIME.rrd in the current directory unless --record names another, and shows it live in a
    browser; --no-live switches the live view off. The recorder keeps the last 256 MB for it. If one of its ports is
    taken, a free one is used.

    Attributes:
        strike: Start the striker too, which returns balls after `volley strike X Y Z`.
    """

    common: Common = field(default_factory=Options)
    sim: Annotated[SimFlags, Unprefixed] = field(default_factory=SimFlags)
    planner: Annotated[PlannerFlags, Unprefixed] = field(default_factory=PlannerFlags)
    recorder: Annotated[RecorderFlags, Unprefixed] = field(
        default_factory=lambda: RecorderFlags(live=True, unindexed=True)
    )
    striker: Annotated[StrikerFlags, Unprefixed] = field(default_factory=StrikerFlags)
    strike: bool = False


def main() -> None:
    """Start all services, print what to do next, wait, end all services."""
    began = time.monotonic()
    flags = tyro.cli(Flags)
    os.environ.setdefault("RUST_LOG", "warn,re_log_encoding=error")  # rerun warns of traces without an index
    console = Console(soft_wrap=True, highlight=False)
    stopping = stop_on_signals()
    try:
        options, recorder = prepare(flags)
        values = {**asdict(flags.sim), **asdict(flags.planner), **asdict(recorder), **asdict(flags.striker)}
        names = [process.name for process in PROCESSES] if flags.strike else None
        with running_cell(options, values, names, give_up=stopping.is_set) as cell, viewer(recorder) as address:
            if not stopping.is_set():
                took = time.monotonic() - began
                first = first_command(cell.bus, flags_for(options, cell.endpoint))
                console.print("\n".join(greeting(flags.sim, options, recorder, cell.endpoint, first, address, took)))
            wait(cell, stopping, console)
            console.print("stopping")
    except ValueError as error:
        print(f"volley: {error}", file=sys.stderr)
        raise SystemExit(MISUSED) from None
    except NotReady as error:
        raise SystemExit(f"volley: {error}") from None
    except zenoh.ZError as error:
        if not stopping.is_set():
            raise SystemExit(f"volley: cannot join the bus: {error}") from None


def prepare(flags: Flags) -> tuple[Options, RecorderFlags]:
    """Return the options with their endpoint, and the recorder's flags with its file and a port that is free.

    Raises:
        SystemExit: an endpoint is taken, or other machines could join without a certificate.
        ValueError: the robot config cannot be read, or flags contradict each other.
    """
    options, recorder = flags.common, flags.recorder
    if options.listen and options.connect:
        raise ValueError("--listen hosts the router, and --connect joins that of another program; give one of the two")
    if not options.listen and not options.connect:
        options = replace(options, listen=(DEFAULT_ENDPOINT,))
    refuse_exposure(options, options.connect, () if options.connect else options.listen)
    if not options.connect:
        for endpoint in filter(is_taken, options.listen):
            raise SystemExit(f"volley: {explain_taken(options, endpoint)}")
    if recorder.record is None:
        recorder = replace(recorder, record=Path(f"volley-{datetime.now():%Y%m%d-%H%M%S}.rrd"))
    return options, replace(recorder, live_port=free_port(recorder.live_port))


def explain_taken(options: Options, endpoint: str) -> str:
    """Return a sentence that says which program has taken an endpoint, and what to do."""
    robot, deadline = robot_name(options), time.monotonic() + LOOK_S
    elsewhere = "start this on another port: --listen tcp/127.0.0.1:7448"
    with contextlib.suppress(zenoh.ZError, SystemExit):
        reach = replace(options, listen=(), connect=(endpoint,))
        with open_bus(reach, robot, give_up=lambda: time.monotonic() > deadline) as bus:
            if bus.is_alive("sim", LOOK_S):
                return (
                    f"robot {robot} runs already on {endpoint}; use it (volley status{flags_for(options, endpoint)}), "
                    f"end it with Ctrl-C where it was started, or {elsewhere}"
                )
    return f"another program listens on {endpoint}; end it, or {elsewhere}"


@contextlib.contextmanager
def viewer(recorder: RecorderFlags) -> Iterator[str | None]:
    """Serve the live view for the length of the block, and yield its address; None without --live."""
    if not recorder.live:
        yield None
        return
    port = free_port(WEB_PORT)
    process = subprocess.Popen(
        web_viewer.command_line(port, recorder.live_port),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        yield web_viewer.address(port, recorder.live_port)
    finally:
        process.kill()
        process.wait()


def flags_for(options: Options, endpoint: str) -> str:
    """Return the flags that every command needs for this robot, empty if the defaults are this robot's."""
    robot = robot_name(options)
    named = "" if robot == robot_name(Options()) else f" --robot {robot}"
    return named + ("" if endpoint == DEFAULT_ENDPOINT else f" --connect {endpoint}")


def first_command(bus: Bus, flags: str) -> str:
    """Return the command that plays a primitive of this arm, or that learns its first one."""
    try:
        joint_names = bus.ask(topics.DESCRIPTION, m.Empty()).joint_names
        library = bus.ask(topics.PRIMITIVES, m.Empty()).primitives
    except (Refusal, NoAnswer):
        return f"volley primitives{flags}"
    own = [entry.name for entry in library if entry.joint_names == joint_names or not entry.joint_names]
    if own:
        return f"volley goal {own[0]} --wait{flags}"
    return f"volley learn RECORDING --name NAME{flags}, then volley goal NAME --wait{flags}"


def greeting(
    sim: SimFlags,
    options: Options,
    recorder: RecorderFlags,
    endpoint: str,
    first: str,
    address: str | None,
    took: float,
) -> Iterator[str]:
    """Yield the lines that a new user needs next; the first has the command that moves the arm."""
    yield f"[bold]volley is ready[/bold] after {took:.1f} s: robot {robot_name(options)} on {endpoint}; Ctrl-C ends it"
    yield f"  move it, in another terminal:   {first}"
    if address:
        yield f"  watch it live, in a browser:    {address}"
    yield f"  the trace, 1.5 MB a second:     {recorder.record}; open it with: rerun {recorder.record}"
    if sim.clock == "realtime" and not realtime.may_be_real_time():
        yield (
            "  missing: real-time rights. Beside other work ticks are late, and the arm brakes; "
            "docs/operations.md says how to grant them, --clock paced needs none"
        )


def wait(cell: RunningCell, stopping: threading.Event, console: Console) -> None:
    """Return once `stopping` is set; say meanwhile which service ended."""
    while not stopping.wait(0.5):
        for name, status in cell.services.ended().items():
            del cell.services.running[name]
            console.print(
                f"[red]{name} {ending(status)}[/red]; the others go on. "
                "Its log says why; end this with Ctrl-C and start it again"
            )


if __name__ == "__main__":
    main()
