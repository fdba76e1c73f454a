"""`volley teach`: a movement from the arm itself, guided by hand, or cut out of a trace."""

import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from client import Refusal, Stream
from protocol import messages as m
from protocol import topics
from tools.recordings.learning import arranged, in_radians
from tools.recordings.recording import Recording, Unreadable
from tools.shell.flags import File, Name, Seconds, Switch
from tools.shell.following import follow
from tools.shell.recordings import learnable
from tools.shell.shell import Shared, Shell, UsageError, reach

KEPT = 1 << 20
"""States that are kept: 17 minutes at 1 kHz."""

REST_S = 10.0
"""How long the arm may take to come to rest once it is no longer guided."""


def teach(
    name: Name,
    *,
    seconds: Seconds = None,
    trace: File = None,
    begin: Seconds = None,
    end: Seconds = None,
    plot: File = None,
    play: Switch = False,
    replace: Switch = False,
    shell: Shared,
) -> int:
    """Teach a movement by guiding the arm, weightless and compliant, until Enter; or cut it out of a trace.

    A simulated arm is moved with `volley disturb`, a real one by hand. Rest at both ends is trimmed, and the recording
    is examined as by `volley learn`. Then the arm holds the pose at which it was let go.

    Args:
        name: Of the new primitive.
        seconds: Record so long, s of the robot's clock, instead of until Enter.
        trace: An .rrd file of the recorder's; the arm is not moved.
        begin: With --trace: from when, s of `sim_time` as Rerun's viewer shows it; by default from its beginning.
        end: With --trace: until when, s; by default to its end.
        plot: Draw raw, fitted and imitated curves with what was found, into a .png or .rrd file, before it is learned.
        play: Then play it once: first back to where it begins.
        replace: Overwrite a primitive of this name.
        shell: How to reach the robot.
    """
    if trace is None and (begin is not None or end is not None):
        raise UsageError("--begin and --end say which part of --trace FILE is taught")
    with reach(shell) as link:
        try:
            raw = _guided(link, name, seconds) if trace is None else _cut(trace, begin, end, link.joint_names())
            recording = in_radians(learnable([raw], link.description(), plot).recording)
        except Unreadable as problem:
            raise UsageError(str(problem)) from None
        learned = link.arm.learn(
            name,
            recording.values,
            times=recording.times.tolist(),
            joint_names=link.joint_names() or None,
            replace=replace,
        )
        link.print(learned)
        if not play or learned.start is None:
            return 0
        back = follow(link, link.arm.goal(name, positions=learned.start.positions))
        return back or follow(link, link.arm.goal(name))


def _cut(trace: Path, begin: float | None, end: float | None, joints: list[str]) -> Recording:
    """Return the measured positions of a part of a trace."""
    from tools.recordings.readers import rrd  # slow to import

    part = rrd.cut(trace, -np.inf if begin is None else begin, np.inf if end is None else end)
    return arranged(part, joints, {})


def _guided(link: Shell, name: str, seconds: float | None) -> Recording:
    """Record the arm while it is guided."""
    names = link.joint_names()
    with link.arm.stream(topics.STATE, KEPT) as stream:
        link.arm.guide()
        try:
            print("the arm yields: guide it through the movement", end="; ", file=sys.stderr)
            states = _until(stream, seconds)
        finally:
            _let_go(link)
    if not states:
        raise Unreadable("no state of the arm came while it was guided; where its clock is stepped, step it meanwhile")
    times = np.array([state.time for state in states])
    positions = np.array([state.positions for state in states])
    return Recording(times, tuple(names), positions, "rad", Path(name), "guided", True)


def _until(stream: Stream[m.State], seconds: float | None) -> list[m.State]:
    """Take states for so many seconds of the robot's time, or until Enter."""
    states: list[m.State] = []
    print("Enter ends it" if seconds is None else f"it records {seconds:g} s", file=sys.stderr)
    entered = _entered() if seconds is None else None
    while True:
        try:
            state = stream.take(timeout=0.2)
        except TimeoutError:
            state = None
        if state is not None and state.condition == "guiding":
            states.append(state)
        taken = states[-1].time - states[0].time if states else 0.0
        if entered() if entered else taken >= (seconds or 0.0):
            return states


def _entered() -> Callable[[], bool]:
    """Return a function that says whether a line came on standard input, or its end."""
    done = threading.Event()

    def wait() -> None:
        sys.stdin.readline()
        done.set()

    threading.Thread(target=wait, daemon=True).start()
    return done.is_set


def _let_go(link: Shell) -> None:
    """Have the arm hold the pose at which it comes to rest."""
    deadline = time.monotonic() + REST_S
    while True:
        try:
            link.arm.recover()
            return
        except Refusal as refusal:
            if refusal.code != "busy" or time.monotonic() > deadline:
                raise
        time.sleep(0.05)
