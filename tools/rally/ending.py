"""The end of a rally, which may be early: exit status and report."""

import json
from collections.abc import Callable, Sequence

from rich.console import Console, RenderableType

from protocol.errors import NoAnswer, Refusal
from tools.rally.flags import Flags


def play_to_end(play: Callable[[], None], console: Console) -> int:
    """Call `play`, and print the reason if it ends early.

    Returns 0; 1 if a service did not reply or refused a request; 130 after an interruption.
    """
    try:
        play()
    except (Refusal, NoAnswer) as error:
        console.print(f"[bold red]the rally ended early[/bold red]: {error}", soft_wrap=True)
        return 1
    except KeyboardInterrupt:
        console.print("interrupted")
        return 130
    return 0


def print_report(
    flags: Flags, console: Console, figures: dict[str, object], lines: Sequence[RenderableType], faults: Sequence[str]
) -> int:
    """Print the figures with --json, otherwise the lines, and the faults; return 1 if there are faults, else 0."""
    if flags.json:
        print(json.dumps(figures))
    else:
        for line in (*lines, f"trace: {flags.record.resolve()}"):
            console.print(line, soft_wrap=isinstance(line, str), highlight=False)
    for fault in faults:
        console.print(f"[bold red]{fault}[/bold red]", soft_wrap=True)
    return 1 if faults else 0
