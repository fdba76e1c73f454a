"""The real-time settings that a process requests from the operating system."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from services.common import realtime
from services.common.realtime import Deadlines


class FakeTime:
    """A clock, ns, that sleeping moves; each look at it takes 1 µs."""

    def __init__(self) -> None:
        self.now = 0

    def monotonic_ns(self) -> int:
        """Return the time."""
        self.now += 1_000
        return self.now

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        self.now += round(seconds * 1e9)


@pytest.fixture
def fake_time(monkeypatch: pytest.MonkeyPatch) -> FakeTime:
    """Return the clock by which deadlines wait."""
    clock = FakeTime()
    monkeypatch.setattr(realtime, "time", clock)
    return clock


def test_deadlines_are_absolute(fake_time: FakeTime):
    """A tick that takes long shortens the next wait, so the mean rate stays the same."""
    deadlines = Deadlines(2_000_000, next_ns=0)
    for tick in range(1, 6):
        fake_time.sleep(0.0015 if tick == 3 else 0.0)
        deadlines.wait()
        assert fake_time.now == pytest.approx(tick * 2_000_000, abs=2_000)
    assert deadlines.stalls == 0


def test_after_a_stall_the_deadlines_continue_from_the_present(fake_time: FakeTime):
    """No ticks run back to back to catch up; the stall and its time are counted."""
    deadlines = Deadlines(1_000_000, next_ns=0)
    fake_time.now = 500_999_000
    deadlines.wait()
    assert (deadlines.stalls, deadlines.lag_ns, deadlines.next_ns) == (1, 500_000_000, 501_000_000)


CORES = """
import os, sys, threading
from services.common import realtime
given, loop_core = eval(sys.argv[1])
if given:
    os.sched_setaffinity(0, given)
usable = os.sched_getaffinity(0)
loops, others = realtime.split_cores(loop_core)
missing = realtime.keep_to(loops)
thread = threading.Thread(target=lambda: print((usable, loops, others, os.sched_getaffinity(0), missing)))
thread.start()
thread.join()
"""
Cores = set[int]


def cores(given: Cores | None = None, loop_core: int | None = None) -> tuple[Cores, Cores, Cores, Cores, list[str]]:
    """Return how a process that may use `given` splits its cores.

    They are those it may use, the loops', all others', those of a thread that a loop starts later, and those it did not
    obtain.
    """
    line = [sys.executable, "-c", CORES, repr((given, loop_core))]
    return eval(subprocess.run(line, stdout=subprocess.PIPE, text=True, check=True).stdout)


def test_loops_share_the_last_core_and_the_rest_leaves_it():
    """The loops get the last of all cores."""
    usable, loops, others, kept, missing = cores()
    assert (kept, missing) == (loops, [])
    if len(usable) == os.cpu_count() and len(usable) > 1:
        assert (loops, others) == ({max(usable)}, usable - {max(usable)})
    else:
        assert loops == others == usable


def test_an_earlier_choice_of_cores_is_kept():
    """A choice by taskset or a unit's CPUAffinity is kept."""
    first = min(os.sched_getaffinity(0))
    assert cores(given={first}) == ({first}, {first}, {first}, {first}, [])


def test_a_requested_core_is_reserved_for_the_loops():
    """A requested core overrides an earlier choice; other threads use it only if there is no other core."""
    usable = os.sched_getaffinity(0)
    first, last = min(usable), max(usable)
    assert cores(loop_core=first) == (usable, {first}, usable - {first} or usable, {first}, [])
    assert cores(given={first}, loop_core=last) == ({first}, {last}, {first}, {last}, [])


@pytest.mark.parametrize("core", [-1, 1 << 12, 1 << 40])
def test_a_missing_core_is_reported(core: int):
    """The loop runs on any core and reports what it did not obtain."""
    usable, _, others, kept, (sentence,) = cores(loop_core=core)
    assert usable == others == kept
    assert sentence.startswith(f"core {core}: ")


LOCKED = """
import re, threading
import numpy
from services.common import realtime
missing = realtime.become_real_time(1)
waiting = threading.Event()
for _ in range(20):
    threading.Thread(target=waiting.wait, daemon=True).start()
with open("/proc/self/status") as status:
    resident = next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))
with open("/proc/self/smaps") as maps:
    blocks = re.split(r"(?m)^(?=[0-9a-f]+-)", maps.read())
code = [block for block in blocks if "openblas" in block and " r-xp" in block]
sizes = [re.findall(r"^(?:Size|Rss): +([0-9]+)", block, re.M) for block in code]
print((missing, resident, sizes))
"""


def test_locked_memory_holds_all_code_but_no_unused_stacks():
    line = [sys.executable, "-c", LOCKED]
    missing, resident, sizes = eval(subprocess.run(line, stdout=subprocess.PIPE, text=True, check=True).stdout)
    if missing:
        pytest.skip(f"not granted: {missing}")
    assert sizes
    assert all(size == loaded for size, loaded in sizes)
    assert resident < 150_000  # kB; twenty stacks of 8 MB are 160,000


PROMPT = """
import os, threading
from services.common import realtime
realtime.become_prompt()
nice = []
thread = threading.Thread(target=lambda: nice.append(os.getpriority(os.PRIO_PROCESS, threading.get_native_id())))
thread.start()
thread.join()
print(nice[0], open("/proc/self/autogroup").read().split()[-1])
"""


def niceness(program: str, privileged: bool = True) -> tuple[int, int]:
    """Return the niceness of a thread and of the session of such a program, in a session of its own."""
    without = [] if privileged or os.geteuid() else ["setpriv", "--bounding-set=-sys_nice", "--inh-caps=-sys_nice"]
    line = [*without, sys.executable, "-c", program]
    done = subprocess.run(line, capture_output=True, text=True, check=True, start_new_session=True)
    thread, session = map(int, done.stdout.split())
    return thread, session


def test_a_prompt_service_has_the_priority_of_its_session():
    """Threads and the session get its priority; without the right to it, the process is nice and its session is not."""
    if not Path("/proc/self/autogroup").exists():
        pytest.skip("this kernel shares cores without sessions")
    thread, session = niceness(PROMPT)
    unable = os.getpriority(os.PRIO_PROCESS, 0) + realtime.POLITE_NICE
    assert (thread, session) in ((realtime.PROMPT_NICE, realtime.PROMPT_NICE), (unable, 0))


def test_a_prompt_service_without_privileges_keeps_its_share():
    """A nice session would get a quarter of another busy program's share, and rallies would fail."""
    if not Path("/proc/self/autogroup").exists() or shutil.which("setpriv") is None:
        pytest.skip("this kernel shares cores without sessions, or setpriv is missing")
    assert niceness(PROMPT, privileged=False)[1] == 0


STEADY = PROMPT.replace("become_prompt", "become_steady")


@pytest.mark.parametrize("granted", [True, False])
def test_a_simulation_leaves_a_share_of_its_core(granted: bool):
    """It has three times the share of an ordinary program, or without the right to it the share of one."""
    if not Path("/proc/self/autogroup").exists() or shutil.which("setpriv") is None:
        pytest.skip("this kernel shares cores without sessions, or setpriv is missing")
    if granted and not realtime.may_be_real_time():
        pytest.skip("needs the right to a negative niceness")
    own = os.getpriority(os.PRIO_PROCESS, 0)
    expected = (realtime.STEADY_NICE, realtime.STEADY_NICE) if granted else (own, 0)
    assert niceness(STEADY, privileged=granted) == expected


@pytest.mark.skipif(not realtime.may_be_real_time(), reason="needs the right to SCHED_FIFO")
def test_receiving_threads_have_real_time_priority_and_the_program_has_not():
    receiving = (
        "import os, threading; from services.common import realtime; ending = threading.Event()\n"
        "thread = threading.Thread(target=ending.wait); thread.start(); realtime.prioritise_existing_threads()\n"
        "print(os.sched_getscheduler(thread.native_id), os.sched_getscheduler(0)); ending.set()"
    )
    run = subprocess.run([sys.executable, "-c", receiving], capture_output=True, text=True, check=True)
    assert run.stdout.split() == [str(os.SCHED_FIFO), str(os.SCHED_OTHER)]


URGENT = """
import os, threading
from services.common import realtime
realtime.become_prompt()
urgency = realtime.Urgency()
for keeps_up in (True, True, False, True, False):
    urgency.update(keeps_up)
    print(os.sched_getscheduler(0), os.sched_getparam(0).sched_priority, os.getpriority(os.PRIO_PROCESS, 0))
ending = threading.Event()
with realtime.prioritise_new_threads():
    thread = threading.Thread(target=ending.wait)
    thread.start()
receiving = thread.native_id
print(os.sched_getscheduler(receiving), os.sched_getparam(receiving).sched_priority, os.sched_getscheduler(0))
ending.set()
"""


@pytest.mark.skipif(not realtime.may_be_real_time(), reason="needs the right to SCHED_FIFO")
def test_a_prompt_service_has_real_time_priority_only_while_it_keeps_up():
    run = subprocess.run(
        [sys.executable, "-c", URGENT], capture_output=True, text=True, check=True, start_new_session=True
    )
    *said, receiving = [tuple(map(int, line.split())) for line in run.stdout.splitlines()]
    first = os.SCHED_FIFO, realtime.PROMPT_PRIORITY, realtime.PROMPT_NICE
    shared = os.SCHED_OTHER, 0, realtime.PROMPT_NICE
    assert said == [first, first, shared, first, shared]
    assert receiving == (os.SCHED_FIFO, realtime.RECEIVING_PRIORITY, os.SCHED_OTHER)


def test_a_prompt_service_without_privileges_keeps_the_normal_scheduler():
    if shutil.which("setpriv") is None:
        pytest.skip("setpriv is missing")
    without = ["setpriv", "--bounding-set=-sys_nice", "--inh-caps=-sys_nice"] if os.geteuid() == 0 else []
    if not without and realtime.may_be_real_time():
        pytest.skip("this user has the right")
    run = subprocess.run(
        [*without, sys.executable, "-c", URGENT], capture_output=True, text=True, check=True, start_new_session=True
    )
    assert {line.split()[0] for line in run.stdout.splitlines()} == {str(os.SCHED_OTHER)}
