"""Clocks of the robot side: the wall clock, lock-step with the controller, or the robot's own clock."""

import logging
import math
import threading
import time
from collections.abc import Sequence

from services.common.logs import ThrottledLog
from services.common.realtime import Deadlines
from services.common.robot_side.controller_presence import HANG_S
from services.common.robot_side.loop import RobotLoop

IDLE_S = 0.02
"""Longest wait of a loop before it checks for other events."""
HEAD_START_NS = 300_000
"""Time reserved for a step, which takes 0.1 to 0.2 ms, and for a late wake-up."""

MEASURED_S, REPEAT_S = 5.0, 60.0
"""Time over which the pace is measured, and the shortest time from one warning to the next."""
SLOW = 0.95
"""Ratio of robot time to wall time below which a warning calls the machine slow."""


class Pace:
    """Delays ticks to the pace of the wall clock, and warns if robot time falls behind."""

    def __init__(self, rate_hz: float, log: logging.Logger) -> None:
        """`rate_hz`: ticks a second of wall time."""
        self._deadlines = Deadlines(round(1e9 / rate_hz))
        self._log = log
        self._next_warning = -math.inf
        self.restart()

    def restart(self) -> None:
        """Restart the measurement: earlier delays were not caused by the machine."""
        self._ticks, self._began = 0, time.monotonic()

    def wait(self) -> None:
        """Sleep until the next tick may start."""
        self._deadlines.wait()
        self._ticks += 1
        now = time.monotonic()
        passed = now - self._began
        if passed >= MEASURED_S:
            ratio = self._ticks * self._deadlines.period_ns * 1e-9 / passed
            if ratio < SLOW and now >= self._next_warning:
                self._log.warning("robot time runs at %.2f of its pace: this machine is slow", ratio)
                self._next_warning = now + REPEAT_S
            self.restart()


def keep_time(loops: Sequence[RobotLoop], stopping: threading.Event, pace: float = 1.0) -> None:
    """Run the loops by their clock, `realtime` or `paced`, until `stopping` is set.

    Several loops drive arms of one simulation; its tick is over when each has stepped. `pace`: largest ratio of robot
    time to wall time, with the clock `paced`.
    """
    first = loops[0]
    if first.backend.abilities.own_clock:
        _follow_robot(first, stopping)
    elif first.clock == "paced":
        _run_paced(loops, stopping, pace)
    else:
        _run_realtime(loops, stopping)


def step_all(loops: Sequence[RobotLoop]) -> None:
    """Step every arm by a tick, then publish the results."""
    for loop in loops:
        loop.step()
    for loop in loops:
        loop.publish()


def _follow_robot(loop: RobotLoop, stopping: threading.Event) -> None:
    """Run by the robot's clock: its `step` returns at its next tick."""
    while not stopping.is_set():
        loop.receive_all()
        loop.step()
        loop.publish()
        loop.attend()


def _run_realtime(loops: Sequence[RobotLoop], stopping: threading.Event) -> None:
    """At each deadline take the newest commands, step, publish.

    If the commands have arrived, the step is taken slightly before the deadline, so that the states are published at
    the deadline and the controller has a whole tick for its answer.
    """
    deadlines = Deadlines(round(1e9 / loops[0].config.rate_hz))
    stalled = ThrottledLog(loops[0].log)
    while not stopping.is_set():
        stalls = deadlines.stalls
        deadlines.near(HEAD_START_NS)
        for loop in loops:
            loop.receive_all()
        ahead = all(loop.is_answered(loop.backend.observe().tick) for loop in loops)
        if ahead:
            for loop in loops:
                loop.step()
        deadlines.wait()
        if deadlines.stalls > stalls:
            stalled.warn(f"the machine stalled; robot time lags by {deadlines.lag_ns * 1e-9:.3f} s in all")
        if not ahead:
            for loop in loops:
                loop.receive_all()
                loop.step()
        for loop in loops:
            loop.publish()
            loop.attend()


def _run_paced(loops: Sequence[RobotLoop], stopping: threading.Event, most: float) -> None:
    """Step when the present tick's time is over and each present controller has answered."""
    pace = Pace(loops[0].config.rate_hz * most, loops[0].log)
    while not stopping.is_set():
        late = next((loop for loop in loops if loop.must_wait()), None)
        if late is None:
            pace.wait()
            for loop in loops:
                loop.receive_all()
            step_all(loops)
        elif (taken := late.commands.take(IDLE_S)) is not None:
            late.receive(taken)
        elif late.controller.starts_to_hang():
            tick = late.backend.observe().tick
            late.log.warning("the controller has not answered tick %d for %g s; time goes on", tick, HANG_S)
            pace.restart()
        for loop in loops:
            loop.attend()
