"""`python -m tools.demo`: start the services, strike five times, print a report, write a trace."""

import sys
from dataclasses import dataclass, field
from pathlib import Path

import tyro
from rich.console import Console

from client import Arm, connect
from protocol import messages as m
from protocol.errors import NoAnswer, Refusal
from robot.description import load_robot
from services.common.cell import running_cell
from services.common.cli import MISUSED, Common, Options, robot_name
from services.common.signals import end_like_ctrl_c
from services.common.supervisor import NotReady
from tools.demo.play import Player, StrikeOutcome
from tools.demo.report import speed, table
from tools.demo.strikes import STRIKES
from tools.progress import progress


@dataclass(frozen=True, slots=True)
class Flags:
    """Start all services, strike five times, print a report, and write a trace.

    The router listens on a free port or on --listen; --connect uses a running router.

    Attributes:
        clock: Clock of the arm. paced waits for a slow machine; realtime does not, so a strike may fail.
        record: Trace to write.
        live: Serve a live viewer on loopback.
        verbose: Show the services' logs.
    """

    common: Common = field(default_factory=Options)
    clock: m.Clock = "paced"
    record: Path = Path("volley-demo.rrd")
    live: bool = False
    verbose: bool = False


def main() -> int:
    """Run the demo; return 0 if every strike stayed within its bounds, 1 otherwise."""
    flags = tyro.cli(Flags)
    console = Console()
    end_like_ctrl_c()
    try:
        outcomes, cycle = run(flags, console)
    except ValueError as error:
        console.print(f"volley: {error}", highlight=False, soft_wrap=True)
        return MISUSED
    except (NotReady, Refusal, NoAnswer) as error:
        console.print(f"[bold red]the demo ended early[/bold red]: {error}")
        return 1
    except KeyboardInterrupt:
        console.print("interrupted")
        return 130
    console.print(table(outcomes, load_robot(flags.common.robot_config).joint_names))
    console.print(speed(outcomes, cycle))
    console.print(f"trace: {flags.record.resolve()}", soft_wrap=True, highlight=False)
    console.print(f"open it with: {viewer()} {flags.record}", soft_wrap=True, highlight=False)
    return report_failures(outcomes, console)


def run(flags: Flags, console: Console) -> tuple[list[StrikeOutcome], m.Cycle]:
    """Start all services, strike, and stop them; return the outcomes and the controller's timing."""
    values: dict[str, object] = {"clock": flags.clock, "record": flags.record, "live": flags.live}
    common = flags.common
    with (
        running_cell(common, values, quiet=not flags.verbose) as cell,
        connect(cell.endpoint, robot_name(common), config=common.zenoh_config) as arm,
    ):
        outcomes = strike_all(arm, console)
        return outcomes, arm.status().cycle


def strike_all(arm: Arm, console: Console) -> list[StrikeOutcome]:
    """Play every strike and show the progress."""
    player, outcomes = Player(arm), []
    with progress(console, "the first strike") as say:
        for number, strike in enumerate(STRIKES, 1):
            title = f"strike {number} of {len(STRIKES)}, {strike.title}"
            outcomes.append(player.play(strike, number, lambda step, title=title: say(f"{title}: {step}")))
    return outcomes


def report_failures(outcomes: list[StrikeOutcome], console: Console) -> int:
    """Print the bounds that failed; return the exit status."""
    status = 0
    for outcome in outcomes:
        for sentence in outcome.failures():
            console.print(f"[bold red]{outcome.strike.title}[/bold red]: {sentence}")
            status = 1
    return status


def viewer() -> str:
    """Return the command of the Rerun viewer in this environment."""
    command = Path(sys.executable).with_name("rerun")
    return str(command.relative_to(Path.cwd())) if command.is_relative_to(Path.cwd()) else "rerun"


if __name__ == "__main__":
    sys.exit(main())
