"""Context of all topics' writers: the trace, its timeline, and the arm."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from protocol import messages as m
from robot.description import RobotConfig
from services.recorder.entities import RUN_EVENT, RUNS, Entity
from services.recorder.runs import Runs, StateTimes
from services.recorder.scene import Scene
from services.recorder.validation import Received
from services.recorder.writer import Rows, TraceWriter

MEMORY_TICKS = 2000
"""Time for which a measurement is kept until its command arrives."""


class Context:
    """The trace of one robot.

    Attributes:
        runs: Trace ticks of the messages of each run.
        state_times: Arrival times of the states in the last two batches.
        measured: Positions (J,) by trace tick, of this batch and the last 2000 ticks, rad.
        pose: The newest measured positions (J,), rad.
    """

    def __init__(self, trace: TraceWriter, config: RobotConfig) -> None:
        self.trace = trace
        self.config = config
        self.names = config.joint_names
        self.rate_hz = config.rate_hz
        self.scene = Scene(config)
        self.runs = Runs(config.rate_hz)
        self.state_times = StateTimes()
        self.measured: dict[int, list[float]] = {}
        self.pose = config.home

    def rows(self, ticks: Sequence[int] | np.ndarray, received: Sequence[Received[Any]]) -> Rows:
        """Return rows at trace ticks, with the wall times of the messages."""
        return Rows(ticks, self.rate_hz, [one.wall_ns for one in received])

    def row(self, tick: int, wall_ns: int) -> Rows:
        """Return one row."""
        return Rows([tick], self.rate_hz, [wall_ns])

    def row_at(self, wall_ns: int) -> Rows:
        """Return one row at the arm's newest tick at a wall time."""
        return self.row(self.state_times.tick_at(wall_ns), wall_ns)

    def event(self, entity: Entity, row: Rows, sentence: str, level: str = "INFO") -> None:
        """Write a sentence to the events."""
        self.trace.texts(entity.path, row, [sentence], level)

    def place(self, one: Received[m.State] | Received[m.Command]) -> int:
        """Return the trace tick of a state or a command; if it begins a run, write the run's number and offset."""
        before, message = self.runs.count, one.message
        if isinstance(message, m.State):
            tick = self.runs.add_state(message.run, message.tick, message.condition == "ready")
        else:
            tick = self.runs.add_command(message.run, message.tick)
        if self.runs.count > before:
            present, row = self.runs.present, self.row(tick, one.wall_ns)
            seconds = present.offset / self.rate_hz
            sentence = f"run {present.run} begins; its tick 0 is tick {present.offset} of the trace, {seconds:.3f} s"
            self.event(RUN_EVENT, row, sentence)
            self.trace.values(RUNS.path, row, run=[present.run], tick_offset=[present.offset], time_offset=[seconds])
        return tick

    def forget_old(self) -> None:
        """Drop measurements whose command can no longer arrive."""
        oldest = self.runs.newest - MEMORY_TICKS
        self.measured = {tick: positions for tick, positions in self.measured.items() if tick > oldest}
