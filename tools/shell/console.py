"""Output of the commands for people."""

from rich.console import Console

PIPE_WIDTH = 140
"""Width of tables that are not printed to a terminal."""


class ShellConsole(Console):
    """Rich's console, for pipes too: wide tables, and BrokenPipeError if the reader has gone, as `print` raises it."""

    def __init__(self, *, stderr: bool = False, soft_wrap: bool = False, highlight: bool = True) -> None:
        super().__init__(stderr=stderr, soft_wrap=soft_wrap, highlight=highlight)
        if not self.is_terminal:
            self.width = PIPE_WIDTH

    def on_broken_pipe(self) -> None:
        """Raise BrokenPipeError; Rich would exit with the status of a refusal."""
        raise BrokenPipeError
