"""Map (run, tick) of the messages, or their wall times, to ticks of the trace, which never go back."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from services.common.ticks import tick_of

STRAY_S = 1.0
"""An event further than this ahead of the newest state belongs to the last run."""


@dataclass(slots=True)
class Run:
    """A run of the arm whose tick t is tick `offset` + t of the trace.

    newest: its newest state's tick. answered: its newest command's tick, −1 before the first.
    """

    run: int
    offset: int
    newest: int
    answered: int = -1


class Runs:
    """Appends each run to the last one.

    Ticks within a run are contiguous: omitted ones are counted as missing.

    Attributes:
        count: Number of runs so far.
        missing_states: Gaps among the states, ticks.
        missing_commands: Gaps among the commands, ticks.
    """

    def __init__(self, rate_hz: float) -> None:
        self.count = 0
        self.missing_states = 0
        self.missing_commands = 0
        self._rate_hz = rate_hz
        self._last_two: list[Run] = []

    @property
    def newest(self) -> int:
        """The newest state's tick of the trace, −1 before the first."""
        return max((run.offset + run.newest for run in self._last_two), default=-1)

    @property
    def present(self) -> Run:
        """The newest run. Raises IndexError before the first."""
        return self._last_two[-1]

    @property
    def offset(self) -> int:
        """The trace tick of the present run's tick 0, 0 before the first run."""
        return self.present.offset if self._last_two else 0

    def add_state(self, run: int, tick: int, ready: bool = True) -> int:
        """Return the trace tick of a state; another run, or a tick that went back, begins a run.

        `ready`: whether the arm follows commands. An arm that stops following them may publish its tick again.
        """
        if not self._last_two or self.present.run != run or self._goes_back(tick, ready):
            self._begin(run, tick)
        present = self.present
        self.missing_states += max(0, tick - present.newest - 1)
        present.newest = tick
        return present.offset + tick

    def add_command(self, run: int, tick: int) -> int:
        """Return the trace tick of the command that answers `tick`, in the newest run of that number."""
        if all(known.run != run for known in self._last_two):
            self._begin(run, tick)
        own = next(known for known in reversed(self._last_two) if known.run == run)
        if own.answered >= 0:
            self.missing_commands += max(0, tick - own.answered - 1)
        own.answered = max(own.answered, tick)
        return own.offset + tick

    def tick_at(self, time: float) -> int:
        """Return the trace tick of a past event at `time` (s) of the arm's clock."""
        tick = tick_of(time, self._rate_hz)
        if len(self._last_two) > 1 and tick > self.present.newest + STRAY_S * self._rate_hz:
            before = self._last_two[0]
            if tick <= before.newest:
                return before.offset + tick
        return self.tick_ahead(time)

    def tick_ahead(self, time: float) -> int:
        """Return the trace tick of a future event at `time` (s) of the present run."""
        return self.offset + tick_of(time, self._rate_hz)

    def _goes_back(self, tick: int, ready: bool) -> bool:
        newest = self.present.newest
        return tick < newest or (tick == newest == 0 and ready)

    def _begin(self, run: int, tick: int) -> None:
        self._last_two = [*self._last_two[-1:], Run(run, self.newest + 1, newest=tick - 1)]
        self.count += 1


class StateTimes:
    """Arrival times of the states of the last two batches: an event at the end of one may arrive with the next."""

    def __init__(self) -> None:
        self._before: tuple[list[int], list[int]] = ([], [])
        self._walls: list[int] = []
        self._ticks: list[int] = []

    def add_batch(self, walls: Sequence[int], ticks: Sequence[int]) -> None:
        """Add a batch of states: the arrival of each, Unix ns, and its trace tick."""
        walls_before, ticks_before = self._before
        self._before = list(walls), list(ticks)
        self._walls, self._ticks = [*walls_before, *walls], [*ticks_before, *ticks]

    @property
    def oldest(self) -> int | None:
        """The trace tick of the oldest known state, None before the first."""
        return self._ticks[0] if self._ticks else None

    def tick_at(self, wall_ns: int) -> int:
        """Return the newest trace tick at `wall_ns`, or the oldest known one; 0 before the first state."""
        return self._ticks[max(0, bisect_right(self._walls, wall_ns) - 1)] if self._ticks else 0
