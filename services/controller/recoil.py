"""The recoil of a hit: when it is accepted, and how long the arm returns to its reference."""

import numpy as np

from protocol import messages as m
from robot.description import RobotConfig
from services.controller.ledger import ActiveGoal


class RecoilWatch:
    """Follows the arm through the window of a hit, which may last longer than the goal.

    Attributes:
        active: Whether the arm is returning to the reference.
    """

    def __init__(self, config: RobotConfig) -> None:
        self._bounds = config.recoil
        self._tick = config.tick
        self._window = round(config.recoil.window * config.rate_hz) if config.recoil else 0
        self._lag = 2 / config.alpha  # s; velocity times this is about the largest position error under eq. 11
        self.clear()

    def clear(self) -> None:
        """End the window: the arm is in a fault, or started a new run."""
        self.active = False
        self._until = -1
        self._hit: m.Result | None = None
        self._thrown: m.Result | None = None

    def follow(self, goal: ActiveGoal | None, tick: int, errors: np.ndarray, velocity_errors: np.ndarray) -> bool:
        """Process the absolute errors (J,) at `tick`, rad and rad/s; return whether they are an accepted recoil.

        goal: the running goal, or None. Its result, or that of the earlier goal with the hit, reports the recoil.
        """
        if self._bounds is None:
            return False
        self._find_window(goal, tick)
        if not (self.active or self.in_window(tick)):
            return False
        largest = float(errors.max())
        fastest = float(velocity_errors.max())
        if max(largest, self._lag * fastest) > self._bounds.tolerance:
            self._note(largest, tick)
        elif self.active:
            self._end(tick)
        return self.in_window(tick) and largest <= self._bounds.positions and fastest <= self._bounds.velocities

    def in_window(self, tick: int) -> bool:
        """Return whether a recoil is accepted at `tick`, the one that was followed last."""
        return tick <= self._until

    def _find_window(self, goal: ActiveGoal | None, tick: int) -> None:
        if goal is None:
            return  # the goal was played to its end: its window stays open
        blocked = goal.result.first_contact is not None and goal.touched is None
        hit = goal.hit if goal.swings and not blocked else None
        ends = [at + self._window for at in (hit, goal.touched) if at is not None and abs(tick - at) <= self._window]
        if ends:
            self._until, self._hit = max(ends), goal.result
        elif goal.result is self._hit:
            self._until = min(self._until, tick - 1)

    def _note(self, largest: float, tick: int) -> None:
        assert self._bounds is not None
        time = tick * self._tick
        if not self.active:
            self.active, self._thrown = True, self._hit
        assert self._thrown is not None
        recoil = self._thrown.recoil
        if recoil is None:
            recoil = m.Recoil(time=time, peak_error=0.0, peak_time=time, tolerance=self._bounds.tolerance)
            self._thrown.recoil = recoil
        recoil.back_time = None
        if largest > recoil.peak_error:
            recoil.peak_error, recoil.peak_time = largest, time

    def _end(self, tick: int) -> None:
        assert self._thrown is not None
        assert self._thrown.recoil is not None
        self.active = False
        self._thrown.recoil.back_time = tick * self._tick
