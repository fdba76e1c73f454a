"""`volley rally` with one arm: start the services, throw balls, report."""

import json

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from deploy.processes import PROCESSES
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from robot.description import RobotConfig, load_robot
from robot.striking.launcher import Launcher
from services.common.cell import running_cell
from tools.rally.exit_status import exit_status_of
from tools.rally.flags import Flags, noise_of
from tools.rally.play import Player, Stroke
from tools.rally.report import reasons, sentence, summary, table
from tools.rally.striker_model import striker_description
from tools.rally.targets import Targets


def play_thrown(flags: Flags, console: Console) -> int:
    """Play thrown balls and print the report.

    Returns 0 if everything was played inside the limits, 130 after an interruption, 1 otherwise.
    """
    strokes: list[Stroke] = []
    status = exit_status_of(lambda: play(flags, console, strokes), console)
    if not strokes:
        return status
    if flags.json:
        print(json.dumps(summary(strokes)))
    else:
        console.print(table(strokes))
        for reason in reasons(strokes):
            console.print(reason, soft_wrap=True, highlight=False)
        console.print(sentence(strokes), soft_wrap=True, highlight=False)
        console.print(f"trace: {flags.record.resolve()}", soft_wrap=True, highlight=False)
    faults = [fault for stroke in strokes for fault in stroke.faults()]
    for fault in faults:
        console.print(f"[bold red]{fault}[/bold red]", soft_wrap=True)
    return status or (1 if faults else 0)


def play(flags: Flags, console: Console, strokes: list[Stroke]) -> None:
    """Start the services, play, and stop the services; strokes are appended as they are played."""
    if not flags.slow >= 1:
        raise ValueError(f"--slow is {flags.slow}; it must be 1 or more")
    if flags.balls < 1:
        raise ValueError(f"--balls is {flags.balls}; it must be 1 or more")
    config = load_robot(flags.common.robot_config)
    launcher, targets = Launcher(config, flags.seed, flags.kind), Targets(flags.target, flags.wander, flags.seed)
    values: dict[str, object] = {"record": flags.record, "live": flags.live, "seed": flags.seed}
    values["pace"] = 1 / flags.slow
    values["method"] = "qp" if flags.method == "once" else flags.method
    names = [process.name for process in PROCESSES]
    with striker_description(flags) as (striker_robot, learned):
        values["learned"] = flags.learned or learned

        def wrap(name: str, line: list[str]) -> list[str]:
            at = line.index("--robot-config") + 1
            return [*line[:at], str(striker_robot), *line[at + 1 :]] if name == "striker" else line

        with running_cell(flags.common, values, names, quiet=not flags.verbose, wrap=wrap) as cell:
            disturb(cell.bus, flags, config)
            show(Player(cell.bus, config, launcher, targets, revise_hz_of(flags)), flags, console, strokes)


def disturb(bus: Bus, flags: Flags, config: RobotConfig) -> None:
    """Request the camera's noise and the wind."""
    noise = noise_of(flags)
    if noise is not None:
        bus.ask(topics.SIM_DISTURB, noise)
    if flags.wind:
        x, y = config.court.net.normal if config.court and config.court.net else (1.0, 0.0)
        bus.ask(topics.SIM_DISTURB, m.Disturb(kind="wind", values=[-flags.wind * y, flags.wind * x, 0.0]))


def revise_hz_of(flags: Flags) -> float:
    """Return the rate of corrections, Hz."""
    return flags.revise_hz if flags.method == "qp" else 0.0


def show(player: Player, flags: Flags, console: Console, strokes: list[Stroke]) -> None:
    """Play every ball and show the progress."""
    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    with Progress(*columns, console=console, transient=True) as progress:
        shown = progress.add_task("the first ball")
        for number in range(1, flags.balls + 1):
            strokes.append(player.play())
            returned = sum(stroke.score.returned for stroke in strokes)
            progress.update(shown, description=f"ball {number} of {flags.balls}, {returned} returned")
