"""Runs of many balls that a file makes resumable."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import gettempdir

from rich.console import Console
from rich.progress import track

from benchmarks.table_tennis.balls import Ball, append, read


class ResumableRun:
    """Balls of one variant. Those in the file are not played again; each new one is appended to it.

    Attributes:
        name: Name of the variant in the file.
        balls: Balls so far, by seed.
        remaining: Seeds of the balls that have not been played.
    """

    def __init__(self, name: str, seeds: range, file: Path | None) -> None:
        """`file`: file with a line of JSON for each ball; None to store none.

        Raises:
            ValueError: the file cannot be read.
        """
        known = read(file, name) if file else {}
        self.name = name
        self.balls = {seed: ball for seed, ball in known.items() if seed in seeds}
        self.remaining = [seed for seed in seeds if seed not in self.balls]
        self._file = file

    def play(self, play_ball: Callable[[int], Ball]) -> Iterator[tuple[int, Ball]]:
        """Play the remaining balls, show the progress, and yield seed and ball of each."""
        for seed in track(self.remaining, f"{self.name:16}", console=Console(stderr=True)):
            ball = self.balls[seed] = play_ball(seed)
            if self._file:
                append(self._file, self.name, seed, ball)
            yield seed, ball


def scratch_folder(name: str) -> Path:
    """Return a directory that later runs of this user find again, for tables that take long to compute."""
    folder = Path(gettempdir()) / f"volley-table-tennis-{os.getuid()}" / name
    folder.mkdir(parents=True, exist_ok=True)
    return folder
