"""The exit status of a rally, which may end early."""

from collections.abc import Callable

from rich.console import Console

from protocol.errors import NoAnswer, Refusal


def exit_status_of(play: Callable[[], None], console: Console) -> int:
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
