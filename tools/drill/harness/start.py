"""Starting a robot cell: real processes on a bus of their own."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from protocol import messages as m
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from robot.description import load_robot
from services.common.cli import Options, free_endpoint
from services.common.supervisor import Supervisor, command_lines
from tools.drill.harness.cell import Cell
from tools.drill.harness.waiting import wait_for

ARM = ("sim", "planner", "controller")


@dataclass(frozen=True, slots=True)
class Plan:
    """What a cell is made of.

    Attributes:
        clock: Of the sim.
        names: The processes to start.
        hosted: The drill hosts the bus instead of the sim.
        shims: For a process by name, a directory whose sitecustomize.py it runs first: how to break it on purpose.
        flags: Values of the services' own flags.
        robot_config: Description of the robot in place of the drill's own.
    """

    clock: m.Clock = "stepped"
    names: tuple[str, ...] = ARM
    hosted: bool = False
    shims: dict[str, Path] = field(default_factory=dict)
    flags: dict[str, object] = field(default_factory=dict)
    robot_config: Path | None = None


Kind = TypeVar("Kind", bound=Cell)


@contextmanager
def started(plan: Plan, options: Options, folder: Path, kind: type[Kind] = Cell) -> Iterator[Kind]:
    """Start a cell of a `kind` in `folder`, wait until it is ready, and end it with the block."""
    options = replace(options, robot_config=plan.robot_config or options.robot_config)
    config = load_robot(options.robot_config)
    robot = options.robot or config.name
    endpoint = free_endpoint()
    folder.mkdir(parents=True, exist_ok=True)
    at = {"connect": (endpoint,)} if plan.hosted else {"listen": (endpoint,)}
    values: dict[str, object] = {"clock": plan.clock, "library": folder / "library", **plan.flags}
    lines = command_lines(replace(options, **at), values)
    lines = {name: _broken_by(plan.shims.get(name), line) for name, line in lines.items() if name in plan.names}
    with (
        _host(endpoint if plan.hosted else None),
        Supervisor(lines, logs=folder) as services,
        Bus(open_session([endpoint]), robot) as bus,
    ):
        services.wait_ready(bus)
        cell = kind(services, bus, endpoint, folder, config, plan.clock == "stepped")
        if {"sim", "controller"} <= set(plan.names):
            wait_for(cell.mode, "the controller to hear of the arm")
        yield cell


@contextmanager
def _host(endpoint: str | None) -> Iterator[None]:
    """Host the bus for the length of the block, where an endpoint is given."""
    if endpoint is None:
        yield
        return
    with Bus(open_session(listen=[endpoint])):
        yield


def _broken_by(shim: Path | None, line: list[str]) -> list[str]:
    return line if shim is None else ["env", f"PYTHONPATH={shim}", *line]
