"""Progress of a command, shown on the console while it runs."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn


@contextmanager
def progress(console: Console, first: str) -> Iterator[Callable[[str], object]]:
    """Show what is done, first `first`, for the length of the block; yield a function that changes the text."""
    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    with Progress(*columns, console=console, transient=True) as shown:
        task = shown.add_task(first)
        yield lambda text: shown.update(task, description=text)
