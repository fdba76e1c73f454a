"""`python -m tools.demo`: start everything, strike five times, report, leave a trace."""

import sys
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

import tyro
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.errors import NoAnswer, Refusal
from robot.description import load_robot
from services.common import realtime
from services.common.cli import Common, Options, free_endpoint, open_bus
from services.common.supervisor import NotReady, Supervisor, command_lines
from tools.demo.play import Outcome, Player
from tools.demo.report import table
from tools.demo.strikes import STRIKES


@dataclass(frozen=True, slots=True)
class Flags:
    """Start everything on a bus of its own, strike five times in real time, report, and leave a trace.

    The bus is on a free port, or where --listen says; with --connect it is one that somebody else hosts.

    Attributes:
        record: The trace to write.
        live: Serve a viewer on loopback meanwhile.
        verbose: Show what the services log.
    """

    common: Common = field(default_factory=Options)
    record: Path = Path("volley-demo.rrd")
    live: bool = False
    verbose: bool = False


def main() -> int:
    """Return 0 where every strike kept what it promised, 1 otherwise."""
    flags = tyro.cli(Flags)
    console = Console()
    realtime.end_like_ctrl_c()
    try:
        outcomes, cycle = run(flags, console)
    except (NotReady, Refusal, NoAnswer) as error:
        console.print(f"[bold red]the demo broke off[/bold red]: {error}")
        return 1
    except KeyboardInterrupt:
        console.print("interrupted")
        return 130
    console.print(table(outcomes, load_robot(flags.common.robot_config).joint_names))
    late = cycle.late_us
    console.print(
        f"last run: {cycle.on_time_ratio:.2%} of {cycle.count} ticks answered in time; an answer took "
        f"{late.p50:.0f} µs in the median, {late.p99:.0f} µs at the 99th percentile"
    )
    console.print(f"trace: {flags.record.resolve()}", soft_wrap=True, highlight=False)
    console.print(f"open it with: {viewer()} {flags.record}", soft_wrap=True, highlight=False)
    return report_broken(outcomes, console)


def run(flags: Flags, console: Console) -> tuple[list[Outcome], m.Cycle]:
    """Start everything on a bus of its own, strike, and end everything; return what came of it."""
    options = flags.common
    if not options.listen and not options.connect:
        options = replace(options, listen=(free_endpoint(),))
    reach = replace(options, connect=options.connect or options.listen, listen=())
    values: dict[str, object] = {"record": flags.record, "live": flags.live}
    robot = load_robot(options.robot_config).name
    with (
        tempfile.TemporaryDirectory(prefix="volley-demo-") as scratch,
        Supervisor(command_lines(options, {**values, "library": f"{scratch}/library"}), not flags.verbose) as services,
        open_bus(reach, robot) as bus,
    ):
        services.wait_ready(bus)
        outcomes = strike_all(bus, console)
        return outcomes, bus.ask(topics.STATUS_QUERY, m.Empty()).cycle


def strike_all(bus: Bus, console: Console) -> list[Outcome]:
    """Play every strike, showing what goes on."""
    columns = SpinnerColumn(), TextColumn("{task.description}: {task.fields[doing]}"), TimeElapsedColumn()
    with Progress(*columns, console=console, transient=True) as progress:
        shown = progress.add_task("", doing="")
        player = Player(bus, lambda doing: progress.update(shown, doing=doing))
        outcomes = []
        for number, strike in enumerate(STRIKES, 1):
            progress.update(shown, description=f"strike {number} of {len(STRIKES)}, {strike.title}")
            outcomes.append(player.play(strike, seed=number))
        return outcomes


def report_broken(outcomes: list[Outcome], console: Console) -> int:
    """Say which promises were broken; return the exit status."""
    status = 0
    for outcome in outcomes:
        for sentence in outcome.broken_promises():
            console.print(f"[bold red]{outcome.strike.title}[/bold red]: {sentence}")
            status = 1
    return status


def viewer() -> str:
    """Return how to call the Rerun viewer that was installed beside this Python."""
    beside = Path(sys.executable).with_name("rerun")
    return str(beside.relative_to(Path.cwd())) if beside.is_relative_to(Path.cwd()) else "rerun"


if __name__ == "__main__":
    sys.exit(main())
