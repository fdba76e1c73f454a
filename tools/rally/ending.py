"""How a rally ends: what was played until then is reported, whatever ended it."""

from collections.abc import Callable

from rich.console import Console

from protocol.errors import NoAnswer, Refusal


def ended(play: Callable[[], None], console: Console) -> int:
    """Play to the end; say so where it ends early.

    Returns 0, 1 where a service was silent or refused something, 130 after an interruption.
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
