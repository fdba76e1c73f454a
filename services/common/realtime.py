"""Real-time scheduling and deadlines."""

import contextlib
import ctypes
import gc
import os
import platform
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

SPIN_NS = 30_000
"""Busy-wait the last 30 µs: shorter adds jitter, longer takes time from processes on this core."""
PROMPT_NICE, STEADY_NICE, POLITE_NICE = -10, -5, 5
"""Niceness of processes that must reply in time, of those that must not fall behind, and the fallback increment."""
PROMPT_PRIORITY, RECEIVING_PRIORITY = 1, 2
"""Priorities of SCHED_FIFO, below the loops of sim and controller: of computing threads, and of receiving ones."""
PROMPT_SWITCH_S = 5e-4
"""Largest delay of a receiving thread by a computing one: the planner needs the arrival times of statuses."""
LOOP_SWITCH_S = 1e-4
"""The same for a 1 kHz loop: with Python's default of 5 ms, a message that arrives while the loop computes would wait
for longer than a tick."""
PROMPT_SLICE_NS = 100_000
"""The shortest slice that Linux grants."""
SCHED_SETATTR = {"x86_64": 314, "aarch64": 274}
"""Number of a system call that the C library does not wrap."""
_LIBC = ctypes.CDLL(None, use_errno=True)
PR_SET_TIMERSLACK = 29
MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT = 1, 2, 4


def split_cores(loop_core: int | None) -> tuple[set[int], set[int]]:
    """Return the cores of the loops of sim and controller, and the cores of all other threads.

    The two loops take turns, so they share one core, `loop_core` or by default the last. A message between them then
    wakes no other core, and planning on other cores is not interrupted several times a tick. A process that may use
    only some of the machine's cores uses these for both.
    """
    usable = os.sched_getaffinity(0)
    if loop_core is None:
        if len(usable) == 1 or len(usable) < (os.cpu_count() or 1):
            return usable, usable
        loop_core = max(usable)
    return {loop_core}, usable - {loop_core} or usable


def keep_to(cores: set[int]) -> list[str]:
    """Restrict this thread, and threads that it starts later, to `cores`; return failures as sentences."""
    try:
        os.sched_setaffinity(0, cores)
    except (OSError, ValueError, OverflowError) as error:
        return [f"core {', '.join(map(str, sorted(cores)))}: {error}"]
    return []


def become_real_time(priority: int) -> list[str]:
    """Request real-time scheduling for a 1 kHz loop; return failures as sentences.

    Threads inherit SCHED_FIFO when they start, so call this before the Zenoh session is opened.
    """
    sys.setswitchinterval(LOOP_SWITCH_S)
    missing = []
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (OSError, AttributeError) as error:
        missing.append(f"SCHED_FIFO {priority}: {error}")
    if _LIBC.mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) != 0 or not _lock_code():
        missing.append(f"mlockall: {os.strerror(ctypes.get_errno())}")
    if _LIBC.prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0) != 0:
        missing.append(f"timer slack of 1 ns: {os.strerror(ctypes.get_errno())}")
    return missing


def _lock_code() -> bool:
    """Lock this process's code in memory; return whether that was granted.

    Data are locked on first use. Locking all at once would take several hundred unused megabytes: each thread has a
    stack of 8 MB, and freed memory that is still mapped would be filled again.
    """
    lines = [line.split() for line in Path("/proc/self/maps").read_text().splitlines()]
    files = [span for span, permissions, *_, path in lines if path.startswith("/") and permissions[0] == "r"]
    spans = [[int(end, 16) for end in span.split("-")] for span in files]
    return all(_LIBC.mlock(ctypes.c_void_p(start), ctypes.c_size_t(end - start)) == 0 for start, end in spans)


def may_be_real_time() -> bool:
    """Return whether this process, and so its children, may use SCHED_FIFO."""
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        os.sched_setscheduler(0, policy, parameters)
    except OSError:
        return False
    return True


class _SchedulingAttributes(ctypes.Structure):
    """Linux's `struct sched_attr`, first version."""

    _fields_ = (
        ("size", ctypes.c_uint32),
        ("policy", ctypes.c_uint32),
        ("flags", ctypes.c_uint64),
        ("nice", ctypes.c_int32),
        ("priority", ctypes.c_uint32),
        ("runtime", ctypes.c_uint64),
        ("deadline", ctypes.c_uint64),
        ("period", ctypes.c_uint64),
    )


def become_prompt() -> None:
    """Request priority and a short time slice, to run at once when a message arrives, before the bus is opened.

    Threads inherit it. Linux 6.12 and later preempt another process in favour of one with a short slice.
    """
    sys.setswitchinterval(PROMPT_SWITCH_S)
    become_nice(PROMPT_NICE)
    _share_promptly()


def become_steady() -> None:
    """Request three times the share of an ordinary program, for a simulation that keeps to the wall clock if it can.

    With SCHED_FIFO, a simulation that the machine is too slow for would leave a twentieth of its core for all others,
    its own planner included. Call this before the bus is opened: threads inherit it.
    """
    sys.setswitchinterval(LOOP_SWITCH_S)
    become_nice(STEADY_NICE, otherwise=0)
    _share_promptly()
    _LIBC.prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0)


def _share_promptly() -> None:
    """Set the ordinary policy for the calling thread, with its niceness and a short slice."""
    number = SCHED_SETATTR.get(platform.machine())
    if number is None:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    else:
        attributes = _SchedulingAttributes(nice=os.getpriority(os.PRIO_PROCESS, 0), runtime=PROMPT_SLICE_NS)
        attributes.size = ctypes.sizeof(attributes)
        _LIBC.syscall(ctypes.c_long(number), 0, ctypes.byref(attributes), 0)


@contextlib.contextmanager
def prioritise_new_threads() -> Iterator[None]:
    """Give threads that start inside the block SCHED_FIFO if it is granted, so that they receive at once.

    Declare topics on the bus inside: for each, Zenoh starts a thread that runs the callback. Threads that compute must
    not get this priority, so start them outside. `prioritise_existing_threads` is for the threads of the session.
    """
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(RECEIVING_PRIORITY))
    try:
        yield
    finally:
        _share_promptly()


class Urgency:
    """Gives the calling thread priority over all ordinary threads while it keeps up with its messages.

    A thread that falls behind loses the priority, so that a flood of requests does not take the whole core. Without
    SCHED_FIFO nothing changes. Threads and processes that it starts inherit its present policy.
    """

    def __init__(self) -> None:
        self._is_first = False

    def update(self, keeps_up: bool) -> None:
        """Take or give up the priority."""
        if keeps_up == self._is_first:
            return
        self._is_first = keeps_up
        if keeps_up:
            with contextlib.suppress(OSError):
                os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PROMPT_PRIORITY))
        else:
            _share_promptly()


def become_nice(niceness: int, otherwise: int = POLITE_NICE) -> None:
    """Set the niceness; negative: priority over ordinary processes, which have 0.

    otherwise: increment of the niceness if that is not granted. By default this process then yields to the loops of
    sim and controller, which are probably ordinary too, and only inside its session: a nice session would starve beside
    the other programs of the machine.
    """
    with contextlib.suppress(OSError):
        if os.getpriority(os.PRIO_PROCESS, 0) != niceness:
            try:
                os.setpriority(os.PRIO_PROCESS, 0, niceness)
            except PermissionError:
                os.nice(otherwise)
                return
        # Linux divides a core among sessions first, and the supervisor starts each service in a separate session.
        if os.getsid(0) == os.getpid():
            Path("/proc/self/autogroup").write_text(str(niceness))


def prioritise_existing_threads() -> None:
    """Give every thread but the calling one SCHED_FIFO, so that Zenoh receives at once.

    Call it once the bus is open, and before threads that compute start.

    For planners and strikers, and for programs that subscribe to 1 kHz streams with the clock `paced`, because the
    publishers wait for slow subscribers: robot time would slow down, and replies, which follow the streams, would
    time out. If it is not granted, nothing changes.
    """
    for thread in (int(task.name) for task in Path("/proc/self/task").iterdir()):
        if thread != threading.get_native_id():
            with contextlib.suppress(OSError):
                os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(RECEIVING_PRIORITY))


def freeze_garbage() -> None:
    """Collect garbage once, then disable the collector; call it after warm-up, so that it never interrupts the loop."""
    gc.collect()
    gc.freeze()
    gc.disable()


@dataclass(slots=True)
class Deadlines:
    """Absolute deadlines `period_ns` apart; after a stall of more than a period they continue from the present time.

    `stalls` counts the stalls; `lag_ns` is their total time.
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
