"""What all drawers share: the trace, where messages lie in it, and the arm."""

from bisect import bisect_right
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from robot.description import RobotConfig
from services.recorder.runs import Lives, Run
from services.recorder.scene import Scene
from services.recorder.validation import Received
from services.recorder.writer import Rows, TraceWriter

MEMORY_TICKS = 2000
"""How long a measurement waits for its command."""


class Drawer(Protocol):
    """Draws the messages of one topic; called once a batch, also with nothing."""

    def draw(self, received: list[Received[Any]]) -> None:
        """Write what came into the trace."""
        ...


class Canvas:
    """The trace of one robot.

    Attributes:
        measured: Positions by laid tick, of this batch and the last 2000 ticks.
        pose: The newest measured positions.
        heard: When the states of the last two batches came, Unix ns, and where they lie.
        begun: Lives begun so far.
    """

    def __init__(self, trace: TraceWriter, config: RobotConfig) -> None:
        self.trace = trace
        self.config = config
        self.names = config.joint_names
        self.rate_hz = config.rate_hz
        self.scene = Scene(config)
        self.lives = Lives(config.rate_hz, self._begin)
        self.begun = 0
        self.measured: dict[int, list[float]] = {}
        self.pose = config.home
        self.heard: tuple[list[int], list[int]] = ([], [])
        self._heard_last: tuple[list[int], list[int]] = ([], [])
        self._wall_ns = 0

    def rows(self, ticks: Sequence[int] | np.ndarray, received: Sequence[Received[Any]]) -> Rows:
        """Rows at laid `ticks`, received as said."""
        return Rows(ticks, self.rate_hz, [one.wall_ns for one in received])

    def row(self, tick: int, wall_ns: int) -> Rows:
        """One row."""
        return Rows([tick], self.rate_hz, [wall_ns])

    def now(self, wall_ns: int) -> Rows:
        """One row at the tick of the arm that was the newest at `wall_ns`, or at the oldest still known."""
        walls, ticks = self.heard
        return self.row(ticks[max(0, bisect_right(walls, wall_ns) - 1)] if ticks else 0, wall_ns)

    def event(self, what: str, row: Rows, sentence: str, level: str = "INFO") -> None:
        """Write a sentence among the events."""
        self.trace.texts(f"/events/{what}", row, [sentence], level)

    def lay_state(self, one: Received[Any]) -> int:
        """Where a state lies; remembers when it came, for the event of a new run."""
        self._wall_ns = one.wall_ns
        return self.lives.lay_state(one.message.run, one.message.tick)

    def lay_command(self, one: Received[Any]) -> int:
        """Where a command lies."""
        self._wall_ns = one.wall_ns
        return self.lives.lay_command(one.message.run, one.message.tick)

    def hear(self, received: Sequence[Received[Any]], ticks: list[int]) -> None:
        """Remember when a batch of states came: what happened among the last of them may be in the next batch."""
        (walls_last, ticks_last), walls = self._heard_last, [one.wall_ns for one in received]
        self.heard, self._heard_last = (walls_last + walls, ticks_last + ticks), (walls, ticks)

    def remember(self, tick: int, positions: list[float]) -> None:
        """Keep a measurement for the command that answers it."""
        self.measured[tick] = positions

    def forget(self) -> None:
        """Let go of measurements whose command will not come any more."""
        oldest = self.lives.newest - MEMORY_TICKS
        self.measured = {tick: positions for tick, positions in self.measured.items() if tick > oldest}

    def _begin(self, life: Run) -> None:
        """Say that a run begins and where it lies."""
        self.begun += 1
        self.measured.clear()
        row = self.row(life.offset + life.newest + 1, self._wall_ns)
        seconds = life.offset / self.rate_hz
        self.event("run", row, f"run {life.run} begins; its tick 0 lies at tick {life.offset}, {seconds:.3f} s")
        self.trace.values("/runs", row, run=[life.run], tick_offset=[life.offset], time_offset=[seconds])
