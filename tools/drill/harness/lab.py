"""Where scenarios are carried out."""

from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Self

from robot.description import load_robot
from services.common.cli import Options
from tools.drill.harness.cell import Cell
from tools.drill.harness.start import CellConfig, started
from tools.drill.harness.steal_monitor import StealMonitor


class Lab:
    """Cells for scenarios: a shared one on the stepped clock for those that break no process, and fresh ones.

    Attributes:
        options: Common options of the services.
        config: The robot's description.
        folder: For logs, libraries and traces; each cell has a folder in it.
        long: Soak for an hour and fuzz with 100,000 messages.
        progress: Called with a few words on what a scenario does now.
        steal_monitor: Runs while the lab is entered.
    """

    def __init__(
        self, options: Options, folder: Path, long: bool = False, progress: Callable[[str], object] = str
    ) -> None:
        self.options = replace(options, log="text")  # scenarios read the times in the logs
        self.folder = folder
        self.config = load_robot(options.robot_config)
        self.long = long
        self.progress = progress
        self.steal_monitor = StealMonitor()
        self._numbers = count(1)
        self._sharing = ExitStack()
        self._shared: Cell | None = None

    def __enter__(self) -> Self:
        self.steal_monitor.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.end_shared()
        finally:
            self.steal_monitor.__exit__()

    def cell(self, config: CellConfig) -> AbstractContextManager[Cell]:
        """Return a fresh cell, ended with the block."""
        return started(config, self.options, self.folder / f"cell-{next(self._numbers)}")

    def shared(self) -> Cell:
        """Return the shared cell at the start of a new run, with the arm at rest at home."""
        if self._shared is None:
            self._shared = self._sharing.enter_context(self.cell(CellConfig()))
        self._shared.reset()
        return self._shared

    def end_shared(self) -> None:
        """End the shared cell; the next scenario that asks for one gets a new one."""
        self._shared = None
        self._sharing.close()
        self._sharing = ExitStack()
