"""`volley rally`: throw balls at the arm, which returns them; report, and leave a trace."""

import contextlib
import json
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import tyro
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from deploy.processes import PROCESSES
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.errors import NoAnswer, Refusal
from robot.description import load_robot
from robot.schema import read_description
from robot.striking.launcher import Kind, Launcher, NoThrow
from services.common import realtime
from services.common.cell import running_cell
from services.common.cli import MISUSED, Common, Options
from services.common.supervisor import NotReady
from tools.rally import partners
from tools.rally.play import Player, Stroke
from tools.rally.report import json_line, sentence, table

STEP_TICKS = 2


@dataclass(frozen=True, slots=True)
class Flags:
    """Throw balls at the arm, which returns them to a target; print a table and leave a trace.

    Attributes:
        balls: How many.
        target: Where they shall land, m; z is the height of the court.
        kind: Whether the balls bounce before they arrive.
        noise: Standard deviation of each coordinate of a sight, m.
        latency: From a sight of the ball to its message, s.
        drag_error: Part by which the striker believes in too much drag.
        restitution_error: Part by which the striker believes in too high a bounce.
        seed: Of the throws and the noise.
        method: qp corrects the swing; once plans it once; dmp plans it once by the movement primitive.
        revise_hz: Corrections a second.
        slow: Wall time over robot time, for machines that are busy: the sim is stepped, and the striker has that much
            more time for each decision; 1: the paced clock.
        learned: File of what the striker has learned; by default a new one, thrown away at the end.
        record: The trace to write.
        live: Serve a viewer on loopback meanwhile.
        partners: 1: balls are thrown at one arm; 2: two arms rally with each other.
        rallies: Of two arms, how many.
        strokes: Of two arms, after which a rally ends.
        json: Print one line of JSON in place of the table.
        verbose: Show what the services log.
    """

    common: Common = field(default_factory=Options)
    balls: int = 20
    target: tuple[float, float, float] = (4.5, 0.0, 0.0)
    kind: Kind = "bounce"
    noise: float = 0.0
    latency: float = 0.0
    drag_error: float = 0.0
    restitution_error: float = 0.0
    seed: int = 0
    method: Literal["qp", "once", "dmp"] = "qp"
    revise_hz: float = 50.0
    slow: float = 1.0
    learned: Path | None = None
    record: Path = Path("volley-rally.rrd")
    live: bool = False
    partners: Literal[1, 2] = 1
    rallies: int = 20
    strokes: int = 60
    json: bool = False
    verbose: bool = False


def main() -> int:
    """Return 0 where every motion was played inside its limits, 1 otherwise."""
    flags = tyro.cli(Flags)
    console = Console(stderr=flags.json)
    realtime.end_like_ctrl_c()
    try:
        return play_partners(flags, console) if flags.partners == 2 else play_thrown(flags, console)
    except (ValueError, NoThrow) as error:
        console.print(f"volley: {error}", highlight=False, soft_wrap=True)
        return MISUSED
    except (NotReady, Refusal, NoAnswer) as error:
        console.print(f"[bold red]the rally ended early[/bold red]: {error}", soft_wrap=True)
        return 1
    except KeyboardInterrupt:
        console.print("interrupted")
        return 130


def play_thrown(flags: Flags, console: Console) -> int:
    """Play thrown balls and report; returns 0 where every motion was played inside its limits, 1 otherwise."""
    strokes: list[Stroke] = []
    play(flags, console, strokes)
    if flags.json:
        print(json_line(strokes))
    else:
        console.print(table(strokes))
        console.print(sentence(strokes), soft_wrap=True, highlight=False)
        console.print(f"trace: {flags.record.resolve()}", soft_wrap=True, highlight=False)
    faults = [fault for stroke in strokes for fault in stroke.faults()]
    for fault in faults:
        console.print(f"[bold red]{fault}[/bold red]", soft_wrap=True)
    return 1 if faults else 0


def play_partners(flags: Flags, console: Console) -> int:
    """Let two arms rally and report; returns 0 where every motion was played inside its limits, 1 otherwise.

    An interruption is reported with what was played until then, and returns 130.
    """
    played: list[partners.Rally] = []
    status = 0
    try:
        rally_with(flags, console, played)
    except KeyboardInterrupt:
        console.print("interrupted")
        status = 130
    if flags.json:
        print(partners.json_line(played))
    else:
        console.print(partners.table(played))
        console.print(partners.sentence(played), soft_wrap=True, highlight=False)
        console.print(f"trace: {flags.record.resolve()}", soft_wrap=True, highlight=False)
    faults = [fault for rally in played for fault in rally.violations]
    for fault in faults:
        console.print(f"[bold red]{fault}[/bold red]", soft_wrap=True)
    return status or (1 if faults else 0)


def rally_with(flags: Flags, console: Console, played: list[partners.Rally]) -> None:
    """Start both arms on a bus of their own, play, end everything; the rallies are appended as they are played."""
    for name, value in (("slow", flags.slow), ("rallies", flags.rallies), ("strokes", flags.strokes)):
        if not value >= 1:
            raise ValueError(f"--{name} is {value}; it must be 1 or more")
    if flags.drag_error or flags.restitution_error:
        raise ValueError("--drag-error and --restitution-error are for thrown balls; leave them out with --partners 2")
    values: dict[str, object] = {"record": flags.record, "live": flags.live, "seed": flags.seed}
    values["method"] = "dmp" if flags.method == "dmp" else "qp"
    values["pace"] = 1 / flags.slow
    configs = partners.load_partners()
    with partners.two_cells(flags.common, values, flags.learned, not flags.verbose) as cells:
        buses = dict(zip(configs, (cell.bus for cell in cells), strict=True))
        court = partners.Court(buses, configs, flags.seed, flags.strokes)
        court.begin(noise_of(flags), flags.revise_hz if flags.method == "qp" else 0.0)
        partners.play_rallies(court, flags.rallies, list(configs), console, played)


def play(flags: Flags, console: Console, strokes: list[Stroke]) -> None:
    """Start everything on a bus of its own, play, end everything; the strokes are appended as they are played."""
    if not flags.slow >= 1:
        raise ValueError(f"--slow is {flags.slow}; it must be 1 or more")
    if flags.balls < 1:
        raise ValueError(f"--balls is {flags.balls}; throw at least 1")
    config = load_robot(flags.common.robot_config)
    launcher = Launcher(config, flags.seed, flags.kind)
    values: dict[str, object] = {"record": flags.record, "live": flags.live, "seed": flags.seed}
    values["method"] = "dmp" if flags.method == "dmp" else "qp"
    names = [process.name for process in PROCESSES]
    with scratch_robot(flags) as (believed, learned):
        values["learned"] = flags.learned or learned

        def wrap(name: str, line: list[str]) -> list[str]:
            at = line.index("--robot-config") + 1
            return [*line[:at], str(believed), *line[at + 1 :]] if name == "striker" else line

        if flags.slow != 1.0:
            values["clock"] = "stepped"
        quiet = not flags.verbose
        with (
            running_cell(flags.common, values, names, quiet=quiet, wrap=wrap) as cell,
            slow_motion(cell.bus, flags.slow),
        ):
            begin(cell.bus, flags)
            show(Player(cell.bus, config, launcher, flags.target), flags, console, strokes)


def begin(bus: Bus, flags: Flags) -> None:
    """Blur the camera, and ask the striker to strike."""
    noise = noise_of(flags)
    if noise is not None:
        bus.ask(topics.SIM_DISTURB, noise)
    revise_hz = flags.revise_hz if flags.method == "qp" else 0.0
    bus.ask(topics.STRIKE, m.StrikeRequest(target=flags.target, revise_hz=revise_hz))


def noise_of(flags: Flags) -> m.Disturb | None:
    """Return what blurs a camera; None where it sees exactly."""
    if not flags.noise and not flags.latency:
        return None
    return m.Disturb(kind="ball_noise", position_std=flags.noise, latency_s=flags.latency, drop_rate=0.0)


def show(player: Player, flags: Flags, console: Console, strokes: list[Stroke]) -> None:
    """Play every ball, showing progress."""
    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    with Progress(*columns, console=console, transient=True) as progress:
        shown = progress.add_task("the first ball comes")
        for number in range(1, flags.balls + 1):
            strokes.append(player.play())
            returned = sum(stroke.score.returned for stroke in strokes)
            progress.update(shown, description=f"ball {number} of {flags.balls}, {returned} returned")


@contextlib.contextmanager
def slow_motion(bus: Bus, slow: float) -> Iterator[None]:
    """Step the sim, `slow` times slower than the wall clock, for the length of the block; 1: do nothing."""
    ended = threading.Event()

    def step() -> None:
        due = time.monotonic()
        while not ended.is_set():
            with contextlib.suppress(Refusal, NoAnswer):
                bus.ask(topics.SIM_STEP, m.Step(ticks=STEP_TICKS))
            due = max(due + STEP_TICKS * 1e-3 * slow, time.monotonic() - 1.0)
            ended.wait(max(0.0, due - time.monotonic()))

    stepping = threading.Thread(target=step, daemon=True)
    if slow != 1.0:
        stepping.start()
    try:
        yield
    finally:
        ended.set()
        if stepping.is_alive():
            stepping.join()


@contextlib.contextmanager
def scratch_robot(flags: Flags) -> Iterator[tuple[Path, Path]]:
    """Yield the robot's TOML as the striker believes it, wrong where that is asked for, and a file to learn into."""
    original = flags.common.robot_config.resolve()
    with tempfile.TemporaryDirectory(prefix="volley-rally-") as folder:
        learned = Path(folder) / "learned.json"
        if not flags.drag_error and not flags.restitution_error:
            yield original, learned
            return
        description = read_description(original)
        wrong: dict[tuple[str, str], object] = {("", "model"): json.dumps(str(original.parent / description.model))}
        if description.ball:
            wrong["ball", "drag"] = description.ball.drag * (1 + flags.drag_error)
        if description.court:
            wrong["court", "restitution"] = description.court.restitution * (1 + flags.restitution_error)
        believed = Path(folder) / original.name
        believed.write_text(changed(original.read_text(), wrong))
        yield believed, learned


def changed(toml: str, values: Mapping[tuple[str, str], object]) -> str:
    """Return a TOML text with other values, by table and key; the rest stays as it is."""
    lines, section = [], ""
    for line in toml.splitlines():
        if line.startswith("["):
            section = line[1:].partition("]")[0]
        key = (section, line.partition("=")[0].strip())
        lines.append(f"{key[1]} = {values[key]}" if key in values else line)
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())
