"""`python -m services`: everything with one robot, until Ctrl-C."""

import threading
from dataclasses import asdict, dataclass, field
from typing import Annotated

import tyro
import zenoh
from rich.console import Console

from robot.description import load_robot
from services.common import realtime
from services.common.cli import Common, Options, PlannerFlags, RecorderFlags, SimFlags, open_bus, refuse_exposure
from services.common.supervisor import NotReady, Supervisor, command_lines

Unprefixed = tyro.conf.arg(name="")


@dataclass(frozen=True, slots=True)
class Flags:
    """Start every service with one robot and keep them until Ctrl-C."""

    common: Common = field(default_factory=Options)
    sim: Annotated[SimFlags, Unprefixed] = field(default_factory=SimFlags)
    planner: Annotated[PlannerFlags, Unprefixed] = field(default_factory=PlannerFlags)
    recorder: Annotated[RecorderFlags, Unprefixed] = field(default_factory=RecorderFlags)


def main() -> None:
    """Start all, say how to reach them, wait, end all."""
    flags = tyro.cli(Flags)
    console = Console()
    stopping = realtime.stop_on_signals()
    options = flags.common
    refuse_exposure(options, options.connect, () if options.connect else options.listen)
    robot = options.robot or load_robot(options.robot_config).name
    commands = command_lines(options, {**asdict(flags.sim), **asdict(flags.planner), **asdict(flags.recorder)})
    reach = Options(options.robot, options.robot_config, options.connect or options.listen, (), options.zenoh_config)
    with Supervisor(commands) as services:
        wait_ready(services, reach, robot, stopping)
        if not stopping.is_set():
            greet(console, robot, reach)
        while not stopping.wait(0.5):
            for name, status in services.ended().items():
                del services.running[name]
                console.print(f"[red]{name} ended with status {status}[/red]; the others go on")
        console.print("stopping")


def wait_ready(services: Supervisor, reach: Options, robot: str, stopping: threading.Event) -> None:
    """Return once every service is ready, or `stopping` was set meanwhile.

    Raises:
        SystemExit: a service ended, or said nothing, or the bus cannot be joined; the sentence says which.
    """

    def give_up() -> bool:
        services.check_running()
        return stopping.is_set()

    try:
        with open_bus(reach, robot, give_up=give_up) as bus:
            services.wait_ready(bus, give_up=stopping.is_set)
    except NotReady as error:
        raise SystemExit(f"volley: {error}") from None
    except zenoh.ZError as error:
        if not stopping.is_set():
            raise SystemExit(f"volley: cannot join the bus: {error}") from None


def greet(console: Console, robot: str, reach: Options) -> None:
    """Say how to reach the services."""
    where = " ".join(reach.connect) or "tcp/127.0.0.1:7447"
    flag = f" --connect {where}" if reach.connect else ""
    console.print(f"[bold]volley is ready[/bold]: robot {robot} on {where}, keys volley/{robot}/…; Ctrl-C ends it")
    console.print(f"  python -m tools.shell{flag} primitives", highlight=False)
    console.print(f"  python -m tools.shell{flag} watch", highlight=False)


if __name__ == "__main__":
    main()
