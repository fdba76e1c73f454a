"""Record the arm while it is guided by hand, by mouse, or by pushes."""

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from client import Refusal, Stream
from protocol import messages as m
from protocol import topics
from tools.recordings.recording import Recording, Unreadable
from tools.shell.shell import Flags, Shell, UsageError

KEPT = 1 << 20
"""Capacity of the recording in states: 17 minutes at 1 kHz."""

REST_S = 10.0
"""Timeout for the arm to come to rest after guiding, s."""


def guided(link: Shell, name: str, seconds: float | None, shown: Path | None) -> Recording:
    """Record the arm while it is guided, for `seconds` of robot time or until Enter.

    `shown`: the description of a simulated arm, which the mouse drags in a window; closing it ends the recording.

    Raises:
        UsageError: the window cannot be opened.
        Unreadable: no state arrived.
    """
    names = link.joint_names()
    with _window(link.flags, shown) as closed, link.arm.stream(topics.STATE, KEPT) as stream:
        link.arm.guide()
        try:
            print("the arm yields: guide it through the movement", end="; ", file=sys.stderr)
            states = _until(stream, seconds, closed)
        finally:
            _let_go(link)
    if not states:
        raise Unreadable("no state of the arm arrived during guiding; if its clock is stepped, step it meanwhile")
    times = np.array([state.time for state in states])
    positions = np.array([state.positions for state in states])
    return Recording(times, tuple(names), positions, "rad", Path(name), "guided", True)


@contextmanager
def _window(flags: Flags, shown: Path | None) -> Iterator[Callable[[], bool]]:
    """Run `volley drag` in a separate process, so that a crash of the window does not lose the recording.

    Yields a function that returns whether the window was closed.
    """
    if shown is None:
        yield lambda: False
        return
    words = [sys.executable, "-m", "tools.shell", "drag", "--robot-config", str(shown), *flags.words]
    with subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            how = process.stdout.readline()
            if not how:  # the process printed the reason to stderr
                raise UsageError("nothing was recorded: the window did not open")
            print(how, end="", file=sys.stderr)
            yield lambda: process.poll() is not None
        finally:
            process.terminate()


def _until(stream: Stream[m.State], seconds: float | None, closed: Callable[[], bool]) -> list[m.State]:
    """Return the states of `seconds` of robot time, or until Enter, or until the window is closed."""
    states: list[m.State] = []
    print("press Enter to end" if seconds is None else f"recording {seconds:g} s", file=sys.stderr)
    entered = _entered() if seconds is None else None
    while True:
        try:
            state = stream.take(timeout=0.2)
        except TimeoutError:
            state = None
        if state is not None and state.condition == "guiding":
            states.append(state)
        taken = states[-1].time - states[0].time if states else 0.0
        if closed() or (entered() if entered else taken >= (seconds or 0.0)):
            return states


def _entered() -> Callable[[], bool]:
    """Return a function that returns whether standard input had a line or has ended."""
    done = threading.Event()

    def wait() -> None:
        sys.stdin.readline()
        done.set()

    threading.Thread(target=wait, daemon=True).start()
    return done.is_set


def _let_go(link: Shell) -> None:
    """Make the arm hold the pose at which it comes to rest."""
    deadline = time.monotonic() + REST_S
    while True:
        try:
            link.arm.recover()
            return
        except Refusal as refusal:
            if refusal.code != "busy" or time.monotonic() > deadline:
                raise
        time.sleep(0.05)
