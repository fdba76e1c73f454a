"""`volley rally`: throw balls, which the arm returns; print a report and write a trace."""

import sys

import tyro
from rich.console import Console

from robot.striking.launcher import NoThrow
from services.common.cli import MISUSED
from services.common.signals import end_like_ctrl_c
from services.common.supervisor import NotReady
from tools.rally.flags import Flags
from tools.rally.partners import play_partners
from tools.rally.thrown import play_thrown


def main() -> int:
    """Play the rally; return 0 if every motion was played inside its limits, 1 otherwise."""
    flags = tyro.cli(Flags)
    console = Console(stderr=flags.json)
    end_like_ctrl_c()
    try:
        return play_partners(flags, console) if flags.partners == 2 else play_thrown(flags, console)
    except (ValueError, NoThrow) as error:
        console.print(f"volley: {error}", highlight=False, soft_wrap=True)
        return MISUSED
    except NotReady as error:
        console.print(f"[bold red]the rally did not begin[/bold red]: {error}", soft_wrap=True)
        return 1


if __name__ == "__main__":
    sys.exit(main())
