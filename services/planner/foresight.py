"""Prediction of the reference trajectory, without a request to the controller."""

import math
import time
from dataclasses import dataclass

import numpy as np

from motion.plan import Plan
from protocol import messages as m
from robot.description import RobotConfig
from services.common.ticks import ROUNDING, tick_of, ticks_ahead

RECEIVED, NEWEST = 10, 3
"""Number of statuses that determine the pace of robot time, and number of the newest that determine its value."""
STALE_S = 0.1
"""Age of the newest status (wall time) above which the robot's time is unknown."""


@dataclass(frozen=True, slots=True)
class _Received:
    """A status: its robot time (s), its epoch, and its arrival, s on the monotonic clock."""

    time: float
    epoch: int
    at: float


@dataclass(frozen=True, slots=True, eq=False)
class _Played:
    """The last accepted motion: the tick of its start, and the controller's epoch since then."""

    goal_id: str
    start: int
    epoch: int
    plan: Plan


class Foresight:
    """Predicts the reference trajectory while the arm plays this planner's newest motion: it is that motion.

    In that epoch the controller plays nothing else. It refuses plans of another epoch as `superseded` and plans that
    start in the past as `late`, so a wrong prediction moves nothing.
    """

    def __init__(self, config: RobotConfig) -> None:
        self._config = config
        self._received: tuple[_Received, ...] = ()
        self._played: _Played | None = None

    def receive(self, status: m.Status) -> None:
        """Add a status that has just arrived; in any thread."""
        received = _Received(status.time, status.epoch, time.monotonic())
        before = self._received[1 - RECEIVED :]
        if before and received.epoch < before[-1].epoch:  # another controller, with another reference
            self._played = None
        self._received = (*before, received) if before and before[-1].time <= received.time else (received,)

    def note(self, goal_id: str, start_time: float, epoch: int, plan: Plan) -> None:
        """Store an accepted motion that was planned in `epoch`."""
        self._played = _Played(goal_id, tick_of(start_time, self._config.rate_hz), epoch + 1, plan)

    def forget(self) -> None:
        """Stop predicting until the next motion is accepted."""
        self._played = None

    def reference(self, lead: float) -> m.Reference | None:
        """Return the point of the reference trajectory `lead` s from now, or None if only the controller knows it."""
        played, now = self._played, self._now()
        if played is None or now is None or self._received[-1].epoch > played.epoch:
            return None
        rate = self._config.rate_hz
        tick = math.floor(now * rate + ROUNDING) + ticks_ahead(lead, rate)
        if not played.start <= tick < played.start + round(played.plan.total_duration * rate):
            return None
        state = played.plan.sample(np.array([(tick - played.start) * self._config.tick]))
        positions, velocities, accelerations = (
            values[0].tolist() for values in (state.positions, state.velocities, state.accelerations)
        )
        at = tick * self._config.tick
        return m.Reference(
            time=at,
            epoch=played.epoch,
            positions=positions,
            velocities=velocities,
            accelerations=accelerations,
            goal_id=played.goal_id,
        )

    @property
    def pace(self) -> float | None:
        """Return the ratio of robot time to wall time, at most 1, or None if it is unknown."""
        received = self._received
        if len(received) < 2 or (passed := received[-1].at - received[0].at) <= 0:
            return None
        return min((received[-1].time - received[0].time) / passed, 1.0)

    def _now(self) -> float | None:
        """Return the robot's time, s, or None if it is unknown.

        A status can arrive late but never early, so the latest estimate of the last few statuses is the best one.
        """
        received, pace, now = self._received, self.pace, time.monotonic()
        if pace is None or now - received[-1].at > STALE_S:
            return None
        return max(status.time + pace * (now - status.at) for status in received[-NEWEST:])
