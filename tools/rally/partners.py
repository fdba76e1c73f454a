"""Two arms rally with each other: `volley rally --partners 2`."""

import contextlib
import tempfile
import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from statistics import median

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from deploy.processes import PROCESSES
from robot.description import RobotConfig, load_robot
from robot.shipped import DEFAULT_ROBOT_CONFIG
from services.common import realtime
from services.common.cell import RunningCell, running_cell
from services.common.cli import Options, free_endpoint
from tools.progress import progress
from tools.rally.ending import play_to_end, print_report
from tools.rally.flags import Flags
from tools.rally.rallies import Rally, RallyPlayer

ROBOTS = tuple(DEFAULT_ROBOT_CONFIG.with_name(name) for name in ("near.toml", "far.toml"))
"""Descriptions of both robots; the sim of the first one simulates both arms."""


def play_partners(flags: Flags, console: Console) -> int:
    """Play rallies of two arms and print the report.

    Returns 0 if everything was played inside the limits, 130 after an interruption, 1 otherwise.
    """
    played: list[Rally] = []
    status = play_to_end(lambda: rally_with(flags, console, played), console)
    faults = [fault for rally in played for fault in rally.faults()]
    lines = [table(played), sentence(played)]
    reported = print_report(flags, console, summary(played), lines, faults)
    return status or reported


def rally_with(flags: Flags, console: Console, played: list[Rally]) -> None:
    """Start the services of both arms, play, and stop the services; rallies are appended as they are played."""
    flags.check("slow", "rallies", "strokes")
    if flags.drag_error or flags.restitution_error:
        raise ValueError("--drag-error and --restitution-error are for thrown balls; leave them out with --partners 2")
    configs = load_partners()
    values = flags.service_flags() | {"unindexed": True}  # the index of a long rally would take gigabytes until its end
    with two_cells(flags.common, values, flags.learned, not flags.verbose) as cells:
        buses = dict(zip(configs, (cell.bus for cell in cells), strict=True))
        realtime.prioritise_existing_threads()
        player = RallyPlayer(buses, configs, flags.seed, flags.strokes)
        player.begin(flags.camera_noise(), flags.correction_hz)
        with progress(console, "the first serve") as say:
            for number in range(flags.rallies):
                begins = f"rally {number + 1} of {flags.rallies}"
                server = list(configs)[number % len(configs)]
                played.append(player.play(server, lambda strokes, begins=begins: say(f"{begins}, {strokes} strokes")))


@contextlib.contextmanager
def two_cells(
    options: Options, flags: Mapping[str, object], learned: Path | None, quiet: bool
) -> Iterator[list[RunningCell]]:
    """Start the services of both arms on one bus, with one sim and one recorder for both.

    Raises:
        NotReady: a service exited, or did not become ready in time.
    """
    endpoint = options.listen or options.connect or (free_endpoint(),)
    near, far = ROBOTS
    names = [process.name for process in PROCESSES]
    with tempfile.TemporaryDirectory(prefix="volley-rally-") as scratch, contextlib.ExitStack() as stack:
        folder = learned or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        hosting = replace(options, robot_config=near, listen=() if options.connect else endpoint)
        joining = replace(options, robot_config=far, listen=(), connect=endpoint)
        others = [name for name in names if name not in ("sim", "recorder")]
        given_up = threading.Event()
        starting = [
            running_cell(options, {**flags, **more}, names, quiet=quiet, give_up=given_up.is_set)
            for options, more, names in (
                (hosting, {"also": (far,), "learned": folder / "near.json"}, names),
                (joining, {"learned": folder / "far.json"}, others),
            )
        ]
        ending = [stack.enter_context(contextlib.ExitStack()) for _ in starting]  # the second cell ends first
        with ThreadPoolExecutor() as pool:  # the second cell waits for the router of the first
            try:
                cells: list[RunningCell] = list(pool.map(contextlib.ExitStack.enter_context, ending, starting))
            except BaseException:
                given_up.set()
                raise
        yield cells


def summary(played: Sequence[Rally]) -> dict[str, object]:
    """Return the figures of all rallies."""
    strokes = [rally.strokes for rally in played]
    return {
        "rallies": len(played),
        "strokes": strokes,
        "median_strokes": median(strokes) if strokes else None,
        "violations": sum(len(rally.faults()) for rally in played),
    }


def table(played: Sequence[Rally]) -> Table:
    """Return one row for each rally."""
    shown = Table(title="Two arms", box=SIMPLE_HEAD, padding=0)
    for heading in ("rally", "served by", "strokes", "s", "closest limit"):
        shown.add_column(heading, justify="right", no_wrap=True)
    shown.add_column("ended by", overflow="fold")
    for number, rally in enumerate(played, 1):
        closest = str(max((found.closest for found in rally.checked.values()), default=""))
        shown.add_row(str(number), rally.server, str(rally.strokes), f"{rally.duration:.1f}", closest, rally.over)
    return shown


def sentence(played: Sequence[Rally]) -> str:
    """Return the figures in words."""
    found = summary(played)
    return (
        f"{found['rallies']} rallies, {found['median_strokes']} strokes in the median; {found['violations']} violations"
    )


def load_partners() -> dict[str, RobotConfig]:
    """Return both robots by name."""
    configs = [load_robot(path) for path in ROBOTS]
    return {config.name: config for config in configs}
