"""Start a robot cell: real processes on a router of their own."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from protocol import messages as m
from protocol.bus.bus import Bus
from protocol.bus.sessions import SERVICE, open_session
from robot.description import load_robot
from services.common.cell import running_cell
from services.common.cli import Options, free_endpoint
from tools.drill.harness.cell import Cell

ARM = ("sim", "planner", "controller")


@dataclass(frozen=True, slots=True)
class CellConfig:
    """Clock and processes of a cell.

    Attributes:
        clock: Clock of the sim.
        services: Services to start.
        separate_router: Whether the drill's process hosts the router instead of the sim.
        shims: By service, a directory whose sitecustomize.py the service imports first, which causes a fault in it.
        flags: Values of the services' own flags.
        robot_config: Description of the robot; by default the drill's.
    """

    clock: m.Clock = "stepped"
    services: tuple[str, ...] = ARM
    separate_router: bool = False
    shims: dict[str, Path] = field(default_factory=dict)
    flags: dict[str, object] = field(default_factory=dict)
    robot_config: Path | None = None


CellT = TypeVar("CellT", bound=Cell)


@contextmanager
def start_cell(
    cell_config: CellConfig, options: Options, folder: Path, cell_type: type[CellT] = Cell
) -> Iterator[CellT]:
    """Start a cell with its files in `folder`, wait until it is ready, and end it with the block."""
    options = replace(options, robot_config=cell_config.robot_config or options.robot_config)
    config = load_robot(options.robot_config)
    endpoint = free_endpoint()
    folder.mkdir(parents=True, exist_ok=True)
    at = {"connect": (endpoint,)} if cell_config.separate_router else {"listen": (endpoint,)}
    values: dict[str, object] = {"clock": cell_config.clock, "library": folder / "library", **cell_config.flags}

    def broken(name: str, line: list[str]) -> list[str]:
        shim = cell_config.shims.get(name)
        return line if shim is None else ["env", f"PYTHONPATH={shim}", *line]

    with (
        _host(endpoint if cell_config.separate_router else None),
        running_cell(replace(options, **at), values, cell_config.services, logs=folder, wrap=broken) as cell,
    ):
        yield cell_type(cell.services, cell.bus, endpoint, folder, config, cell_config.clock == "stepped")


@contextmanager
def _host(endpoint: str | None) -> Iterator[None]:
    """Host a router for the block, if an endpoint is given."""
    if endpoint is None:
        yield
        return
    with Bus(open_session(listen=[endpoint], timeouts=SERVICE)):
        yield
