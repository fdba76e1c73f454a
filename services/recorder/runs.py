"""Where the messages of one life of the arm after another lie in the trace."""

from collections.abc import Callable
from dataclasses import dataclass

STRAY_S = 1.0
"""What happened further than this ahead of the newest state happened in the life before."""


@dataclass(slots=True)
class Run:
    """One run of the arm: its tick t lies at `offset` + t. `newest` and `answered`: the last ones of both streams."""

    run: int
    offset: int
    newest: int
    answered: int


class Lives:
    """Lays each run behind the one before. `begun` is told of every new one.

    Ticks are contiguous: those left out since the first one of a run are counted as missing.
    """

    def __init__(self, rate_hz: float, begun: Callable[[Run], None]) -> None:
        self.rate_hz = rate_hz
        self._begun = begun
        self._lives: list[Run] = []
        self.missing_states = 0
        self.missing_commands = 0

    @property
    def newest(self) -> int:
        """The newest tick laid, −1 before the first."""
        return max((life.offset + life.newest for life in self._lives[-2:]), default=-1)

    @property
    def offset(self) -> int:
        """Where tick 0 of the present life lies."""
        return self._lives[-1].offset if self._lives else 0

    def lay_state(self, run: int, tick: int) -> int:
        """Return where the state of `tick` lies; another run, or a tick that went back, begins a life."""
        if not self._lives or self._lives[-1].run != run or tick <= self._lives[-1].newest:
            self._begin(run, tick)
        life = self._lives[-1]
        self.missing_states += max(0, tick - life.newest - 1)
        life.newest = tick
        return life.offset + tick

    def lay_command(self, run: int, tick: int) -> int:
        """Return where the command that answers `tick` lies: in the newest life of its run."""
        life = next((life for life in reversed(self._lives[-2:]) if life.run == run), None)
        if life is None:
            self._begin(run, tick)
            life = self._lives[-1]
        if life.answered >= 0:
            self.missing_commands += max(0, tick - life.answered - 1)
        life.answered = max(life.answered, tick)
        return life.offset + tick

    def lay_time(self, time: float) -> int:
        """Return where something lies that happened at `time` (s) of the arm's clock."""
        tick = round(time * self.rate_hz)
        if len(self._lives) > 1 and tick > self._lives[-1].newest + STRAY_S * self.rate_hz:
            before = self._lives[-2]
            if tick <= before.newest:
                return before.offset + tick
        return self.lay_ahead(time)

    def lay_ahead(self, time: float) -> int:
        """Return where something lies that will happen at `time` (s) of the present life."""
        return self.offset + round(time * self.rate_hz)

    def _begin(self, run: int, tick: int) -> None:
        life = Run(run, self.newest + 1, newest=tick - 1, answered=-1)
        self._lives = [*self._lives[-1:], life]
        self._begun(life)
