"""When a tick passes: by the wall clock, in lock-step at its pace, or when the robot says so."""

import threading

from services.common.logs import ThrottledLog
from services.common.realtime import Deadlines
from services.common.robot_side.controller_presence import HANG_S
from services.common.robot_side.loop import RobotLoop
from services.common.robot_side.pace import Pace

IDLE_S = 0.02
"""How long a loop that waits goes without a look around."""
HEAD_START_NS = 300_000
"""Time for a step, which takes 0.1 to 0.2 ms, and for a late wake-up."""


def keep_time(loop: RobotLoop, stopping: threading.Event) -> None:
    """Let time pass on the loop's clock, `realtime` or `paced`, until `stopping` is set."""
    if loop.backend.abilities.own_clock:
        _follow_robot(loop, stopping)
    elif loop.clock == "paced":
        _run_paced(loop, stopping)
    else:
        _run_realtime(loop, stopping)


def _follow_robot(loop: RobotLoop, stopping: threading.Event) -> None:
    """The robot is the clock: its `step` returns at its next tick."""
    while not stopping.is_set():
        loop.receive_all()
        loop.step()
        loop.publish()
        loop.attend()


def _run_realtime(loop: RobotLoop, stopping: threading.Event) -> None:
    """At each deadline take the newest command, step, publish.

    A step whose command is there is taken a little ahead, so that the state comes out at the deadline and the
    controller has the whole tick for its answer.
    """
    deadlines = Deadlines(round(1e9 / loop.config.rate_hz))
    stalled = ThrottledLog(loop.log)
    while not stopping.is_set():
        stalls = deadlines.stalls
        deadlines.near(HEAD_START_NS)
        loop.receive_all()
        ahead = loop.drive.answered_tick == loop.backend.observe().tick
        if ahead:
            loop.step()
        deadlines.wait()
        if deadlines.stalls > stalls:
            stalled.warn(f"the machine stalled; robot time lags by {deadlines.lag_ns * 1e-9:.3f} s in all")
        if not ahead:
            loop.receive_all()
            loop.step()
        loop.publish()
        loop.attend()


def _run_paced(loop: RobotLoop, stopping: threading.Event) -> None:
    """Step once the present tick's time is over and, where there is a controller, it has answered."""
    pace = Pace(loop.config.rate_hz, loop.log)
    while not stopping.is_set():
        tick = loop.backend.observe().tick
        if loop.is_answered(tick) or not loop.controller.is_awaited:
            pace.wait()
            loop.receive_all()
            loop.step()
            loop.publish()
        elif (taken := loop.commands.take(IDLE_S)) is not None:
            loop.receive(taken)
        elif loop.controller.starts_to_hang():
            loop.log.warning("the controller has not answered tick %d for %g s; time goes on", tick, HANG_S)
            pace.restart()
        loop.attend()
