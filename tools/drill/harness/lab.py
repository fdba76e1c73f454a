"""The environment of scenarios."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Self

from robot.description import load_robot
from services.common.cli import Options
from tools.drill.harness.cell import Cell
from tools.drill.harness.start import CellConfig, start_cell
from tools.drill.harness.steal_monitor import StealMonitor


class Lab:
    """Cells for scenarios: one shared cell on the stepped clock, for scenarios that end no process, and new cells.

    Attributes:
        options: Common options of the services.
        config: Description of the robot.
        folder: Directory of logs, libraries and traces; each cell has a directory in it.
        long: Soak for an hour and fuzz with 100,000 messages.
        progress: Called with a short description of the scenario's present activity.
        steal_monitor: Monitor of CPU steal, which runs while the lab is entered.
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

    @contextmanager
    def cell(self, config: CellConfig) -> Iterator[Cell]:
        """Start a new cell, and end it with the block; in real time, recover its arm from stalls of the start."""
        with start_cell(config, self.options, self.folder / f"cell-{next(self._numbers)}") as cell:
            if config.clock == "realtime":
                cell.recover()
            yield cell

    def shared_cell(self) -> Cell:
        """Begin a run of the shared cell with the arm at rest at home, and return the cell."""
        if self._shared is None:
            self._shared = self._sharing.enter_context(self.cell(CellConfig()))
        self._shared.reset()
        return self._shared

    def end_shared(self) -> None:
        """End the shared cell; the next call of `shared_cell` starts a new one."""
        self._shared = None
        self._sharing.close()
        self._sharing = ExitStack()
