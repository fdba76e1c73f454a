"""Admission of the arm's states."""

from protocol import messages as m
from protocol.errors import Refusal


class States:
    """The arm's newest state, and the rule which states may follow it.

    Attributes:
        newest: None before the first.
        stepped: Whether the clock is stepped. A run's number is then its seed, so a run with the same number may start.
    """

    def __init__(self, joint_count: int) -> None:
        self.newest: m.State | None = None
        self.stepped = False
        self._lengths = (joint_count,) * 4

    def admits(self, state: m.State) -> bool:
        """Return whether `state` fits the arm and is newer than the newest one."""
        again = self.stepped and state.tick == 0 and not (state.condition != "ready" and self.repeats(state))
        return self._fits(state) and (again or not self.has_seen(state.run, state.tick))

    def repeats(self, state: m.State) -> bool:
        """Return whether `state` fits the arm and is of the newest state's tick.

        The arm publishes a tick again when its condition changes.
        """
        same = self.newest is not None and (state.run, state.tick) == (self.newest.run, self.newest.tick)
        return same and self._fits(state)

    def opens_run(self, state: m.State) -> bool:
        """Return whether `state`, which must be admitted, is the first of a run."""
        return self.newest is None or state.run != self.newest.run or state.tick <= self.newest.tick

    def has_seen(self, run: int, tick: int) -> bool:
        """Return whether the newest state is that of `tick` in `run`, or a later one."""
        return self.newest is not None and self.newest.run == run and tick <= self.newest.tick

    def _fits(self, state: m.State) -> bool:
        """Return whether `state` has a tick, and values for each joint."""
        truth = state.truth or state
        given = len(state.positions), len(state.velocities), len(truth.positions), len(truth.velocities)
        return state.tick >= 0 and given == self._lengths

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
