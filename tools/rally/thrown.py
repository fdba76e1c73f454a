"""`volley rally` with one arm: start the services, throw balls, report."""

from rich.console import Console

from deploy.processes import PROCESSES
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from robot.description import RobotConfig, load_robot
from robot.striking.launcher import Launcher
from services.common.cell import running_cell
from tools.progress import progress
from tools.rally.ending import play_to_end, print_report
from tools.rally.flags import Flags
from tools.rally.play import Player, Stroke, Targets
from tools.rally.report import reasons, sentence, summary, table
from tools.rally.striker_model import striker_description


def play_thrown(flags: Flags, console: Console) -> int:
    """Play thrown balls and print the report.

    Returns 0 if everything was played inside the limits, 130 after an interruption, 1 otherwise.
    """
    strokes: list[Stroke] = []
    status = play_to_end(lambda: play(flags, console, strokes), console)
    if not strokes:
        return status
    lines = [table(strokes), *reasons(strokes), sentence(strokes)]
    faults = [fault for stroke in strokes for fault in stroke.faults()]
    reported = print_report(flags, console, summary(strokes), lines, faults)
    return status or reported


def play(flags: Flags, console: Console, strokes: list[Stroke]) -> None:
    """Start the services, play, and stop the services; strokes are appended as they are played."""
    flags.check("slow", "balls")
    config = load_robot(flags.common.robot_config)
    launcher, targets = Launcher(config, flags.seed, flags.kind), Targets(flags.target, flags.wander, flags.seed)
    names = [process.name for process in PROCESSES]
    with striker_description(flags) as (striker_robot, learned):
        values = flags.service_flags() | {"learned": flags.learned or learned}

        def wrap(name: str, line: list[str]) -> list[str]:
            at = line.index("--robot-config") + 1
            return [*line[:at], str(striker_robot), *line[at + 1 :]] if name == "striker" else line

        with running_cell(flags.common, values, names, quiet=not flags.verbose, wrap=wrap) as cell:
            disturb(cell.bus, flags, config)
            player = Player(cell.bus, config, launcher, targets, flags.correction_hz)
            with progress(console, "the first ball") as say:
                for number in range(1, flags.balls + 1):
                    strokes.append(player.play())
                    returned = sum(stroke.score.returned for stroke in strokes)
                    say(f"ball {number} of {flags.balls}, {returned} returned")


def disturb(bus: Bus, flags: Flags, config: RobotConfig) -> None:
    """Request the camera's noise and the wind."""
    noise = flags.camera_noise()
    if noise is not None:
        bus.ask(topics.SIM_DISTURB, noise)
    if flags.wind:
        x, y = config.court.net.normal if config.court and config.court.net else (1.0, 0.0)
        bus.ask(topics.SIM_DISTURB, m.Disturb(kind="wind", values=[-flags.wind * y, flags.wind * x, 0.0]))
