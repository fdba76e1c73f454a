"""`volley rally`: throw balls at the arm, which returns them; report, and leave a trace."""

import sys

import tyro
from rich.console import Console

from protocol.errors import NoAnswer, Refusal
from robot.striking.launcher import NoThrow
from services.common import realtime
from services.common.cli import MISUSED
from services.common.supervisor import NotReady
from tools.rally import partners
from tools.rally.flags import Flags, noise_of
from tools.rally.thrown import play_thrown


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


if __name__ == "__main__":
    sys.exit(main())
