"""Real-time scheduling, deadlines, and the signals that end a process."""

import contextlib
import ctypes
import gc
import os
import signal
import sys
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

from services.common.lifeline import follow_supervisor

EXIT_TAKEN = 3
"""Exit status of a service that finds its place on the bus taken."""

SPIN_NS = 30_000
"""Busy-wait the last 30 µs: shorter adds jitter, longer takes time from processes on this core."""
PR_SET_TIMERSLACK = 29
MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT = 1, 2, 4


def stop_on_signals() -> threading.Event:
    """Return an event that SIGTERM, SIGINT and the end of the supervisor set, in place of killing the process.

    A separate thread waits for the signals, and this one blocks them: in Python 3.11 a signal that interrupts
    `SimpleQueue.get` near the end of its timeout leaves it waiting for ever. Threads that a library made before this
    call do not block them. The handlers keep a signal that reaches one of those from killing the process, and set the
    event when this thread next runs: wait for the event with a short timeout, in a loop.
    """
    stopping = threading.Event()
    numbers = {signal.SIGTERM, signal.SIGINT}
    for number in numbers:
        signal.signal(number, lambda *_: stopping.set())
    signal.pthread_sigmask(signal.SIG_BLOCK, numbers)

    def wait() -> None:
        signal.sigwait(numbers)
        stopping.set()

    threading.Thread(target=wait, name="signals", daemon=True).start()
    follow_supervisor(stopping)
    return stopping


def end_like_ctrl_c() -> None:
    """Make the first SIGTERM raise KeyboardInterrupt, so that context managers end what they started.

    Later ones are ignored: they would interrupt that and leave processes behind. `timeout` sends two.
    """

    def interrupt(*_: object) -> None:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, interrupt)


def split_cores(loop_core: int | None) -> tuple[set[int], set[int]]:
    """Return the cores of the loops of sim and controller, and those of everything else.

    The two loops take turns, so they share one core, `loop_core` or by default the last: a message between them wakes
    no other core, and a plan elsewhere is not interrupted several times a tick. A process that may use only some of the
    machine's cores uses those for both.
    """
    usable = os.sched_getaffinity(0)
    if loop_core is None:
        if len(usable) == 1 or len(usable) < (os.cpu_count() or 1):
            return usable, usable
        loop_core = max(usable)
    return {loop_core}, usable - {loop_core} or usable


def keep_to(cores: set[int]) -> list[str]:
    """Restrict this thread, and those it starts later, to `cores`; return what was not granted, as sentences."""
    try:
        os.sched_setaffinity(0, cores)
    except (OSError, ValueError, OverflowError) as error:
        return [f"core {', '.join(map(str, sorted(cores)))}: {error}"]
    return []


def become_real_time(priority: int) -> list[str]:
    """Ask for what a 1 kHz loop needs and return what was not granted, as sentences.

    Threads inherit SCHED_FIFO when they start, so call this before the Zenoh session is opened. With Python's default
    switch interval of 5 ms, a message that arrives while the loop computes would wait for longer than a tick.
    """
    sys.setswitchinterval(1e-4)
    libc = ctypes.CDLL(None, use_errno=True)
    missing = []
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (OSError, AttributeError) as error:
        missing.append(f"SCHED_FIFO {priority}: {error}")
    if libc.mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) != 0 or not _lock_code(libc):
        missing.append(f"mlockall: {os.strerror(ctypes.get_errno())}")
    if libc.prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0) != 0:
        missing.append(f"timer slack of 1 ns: {os.strerror(ctypes.get_errno())}")
    return missing


def _lock_code(libc: ctypes.CDLL) -> bool:
    """Read the code of this process into memory and keep it there; return whether that was granted.

    Data stay in memory from their first use on. Locked at once they would take several hundred megabytes that are never
    used: each thread has a stack of 8 MB, and freed memory that is still mapped would be filled again.
    """
    lines = [line.split() for line in Path("/proc/self/maps").read_text().splitlines()]
    files = [span for span, permissions, *_, path in lines if path.startswith("/") and permissions[0] == "r"]
    spans = [[int(end, 16) for end in span.split("-")] for span in files]
    return all(libc.mlock(ctypes.c_void_p(start), ctypes.c_size_t(end - start)) == 0 for start, end in spans)


def may_be_real_time() -> bool:
    """Return whether this process, and so those it starts, may have SCHED_FIFO."""
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        os.sched_setscheduler(0, policy, parameters)
    except OSError:
        return False
    return True


def become_polite() -> None:
    """Lower this process's priority, in favour of the real-time loops."""
    with contextlib.suppress(OSError):
        os.nice(5)


def freeze_garbage() -> None:
    """Collect garbage once, then never again; call it after warm-up, so that no collection interrupts the loop."""
    gc.collect()
    gc.freeze()
    gc.disable()


@dataclass(slots=True)
class Deadlines:
    """Absolute deadlines `period_ns` apart; after a stall of more than a period they continue from the present time.

    `stalls` counts the stalls, and `lag_ns` is the time they took in all.
    """

    period_ns: int
    next_ns: int = field(default_factory=time.monotonic_ns)
    stalls: int = 0
    lag_ns: int = 0

    def near(self, ahead_ns: int) -> None:
        """Sleep until `ahead_ns` before the next deadline."""
        left = self.next_ns + self.period_ns - ahead_ns - time.monotonic_ns()
        if left > 0:
            time.sleep(left * 1e-9)

    def wait(self) -> None:
        """Sleep until the next deadline, busy-waiting the last 30 µs."""
        self.next_ns += self.period_ns
        left = self.next_ns - time.monotonic_ns()
        if left < -self.period_ns:
            self.stalls += 1
            self.lag_ns -= left
            self.next_ns -= left
            return
        if left > SPIN_NS:
            time.sleep((left - SPIN_NS) * 1e-9)
        while time.monotonic_ns() < self.next_ns:
            pass
