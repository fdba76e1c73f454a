"""Admission of the arm's states."""

from collections import deque

from protocol import messages as m
from protocol.errors import Refusal

REMEMBERED = 16
"""Number of earlier runs whose late states are refused: they would begin a run, which ends all goals and a fault."""


class States:
    """The arm's newest state, and the rule which states may follow it.

    Attributes:
        newest: None before the first.
        stepped: Whether the clock is stepped. A run's number is then its seed, so a run with the same number may start.
        realtime: Whether the arm does not wait for answers.
    """

    def __init__(self, joint_count: int, silence_ticks: int) -> None:
        self.newest: m.State | None = None
        self.stepped = False
        self.realtime = False
        self._silence_ticks = silence_ticks
        self._first: m.State | None = None
        self._left: deque[int] = deque(maxlen=REMEMBERED)
        self._lengths = (joint_count,) * 5

    def admits(self, state: m.State) -> bool:
        """Return whether `state` fits the arm and is newer than the newest one."""
        again = self.stepped and state.tick == 0 and not (state.condition != "ready" and self.repeats(state))
        stale = not self.stepped and state.run in self._left
        return self._fits(state) and not stale and (again or not self.has_seen(state.run, state.tick))

    def take(self, state: m.State) -> None:
        """Store an admitted state as the newest."""
        if self.newest is not None and state.run != self.newest.run:
            self._left.append(self.newest.run)
        self.newest = state

    def repeats(self, state: m.State) -> bool:
        """Return whether `state` fits the arm and is of the newest state's tick.

        The arm publishes a tick again when its condition changes.
        """
        same = self.newest is not None and (state.run, state.tick) == (self.newest.run, self.newest.tick)
        return same and self._fits(state)

    def opens_run(self, state: m.State) -> bool:
        """Return whether `state`, which must be admitted, is the first of a run."""
        return self.newest is None or state.run != self.newest.run or state.tick <= self.newest.tick

    def must_wait(self, state: m.State) -> bool:
        """Return whether the arm may follow an earlier controller still, with an acceleration that it does not publish.

        After `silence_ticks` it brakes, and ignores commands until it rests. With another clock it would wait for the
        answer instead.
        """
        if not self.realtime or state.accelerations is not None:
            return False
        if self._first is None or self._first.run != state.run:
            self._first = state
        return state.tick - self._first.tick < self._silence_ticks

    def has_seen(self, run: int, tick: int) -> bool:
        """Return whether the newest state is that of `tick` in `run`, or a later one."""
        return self.newest is not None and self.newest.run == run and tick <= self.newest.tick

    def _fits(self, state: m.State) -> bool:
        """Return whether `state` has a tick, and values for each joint."""
        truth = state.truth or state
        accelerations = state.positions if state.accelerations is None else state.accelerations
        given = state.positions, state.velocities, truth.positions, truth.velocities, accelerations
        return state.tick >= 0 and tuple(map(len, given)) == self._lengths

    def require(self) -> m.State:
        """Return the newest state.

        Raises:
            Refusal: `unavailable` before the first.
        """
        if self.newest is None:
            raise Refusal("unavailable", "the arm has not published a state yet; start the sim", service="sim")
        return self.newest


def speed_of(state: m.State) -> float:
    """Return the speed of the fastest joint, rad/s; the true one if it is known."""
    return max(abs(velocity) for velocity in (state.truth or state).velocities)
