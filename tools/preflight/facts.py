"""What the operating system says about a machine, each fact with what would be better; privileges are not needed."""

import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from protocol.bus.sessions import RECORDER
from services.common.steal_time import stolen_share

CLOCKS = ("tsc", "kvm-clock", "arch_sys_counter")
"""Clock sources that are read without a system call."""

FAIR = 1e-5
"""Share of the time: 36 ms an hour."""

CORES = 4
"""One for the sim or the robot's driver, one for the controller, two for the rest."""


@dataclass(frozen=True, slots=True)
class Fact:
    """One line of the table. `good` is None where the machine does not say; `advice` is empty where nothing is amiss.

    `needed`: without it the machine is not fit for an arm, however well the sample went. `timing`: it bears on ticks.
    `braking`: where it is amiss, an arm may brake now and then.
    """

    name: str
    found: str
    good: bool | None
    advice: str = ""
    needed: bool = False
    timing: bool = True
    braking: bool = False


def granted(missing: Sequence[str]) -> tuple[Fact, Fact, Fact]:
    """Return what `realtime.become_real_time`, which returned `missing`, was given."""
    by_name = {sentence.split()[0].rstrip(":"): sentence for sentence in missing}
    scheduler, memory, slack = (by_name.get(name) for name in ("SCHED_FIFO", "mlockall", "timer"))
    return (
        Fact("scheduler", scheduler or "SCHED_FIFO", not scheduler, "LimitRTPRIO=60, or ulimit -r 60", needed=True),
        Fact("memory lock", memory or "mlockall", not memory, "LimitMEMLOCK=infinity, or ulimit -l unlimited", True),
        Fact("timer slack", slack or "1 ns", not slack),
    )


def cores(usable: int, isolated: str) -> Fact:
    """Judge how many cores this process may use, and which the kernel keeps free of others."""
    found = f"{usable} usable, isolated: {isolated or 'none'}"
    return Fact("cores", found, usable >= CORES, f"{CORES} or more, two of them isolated (isolcpus=2,3)")


def governor(names: Sequence[str]) -> Fact:
    """Judge the frequency governors of the cores; virtual machines have none."""
    good = set(names) == {"performance"} if names else None
    return Fact("governor", ", ".join(sorted(set(names))) or "not told", good, "cpupower frequency-set -g performance")


def kernel(version: str, realtime: str) -> Fact:
    """Judge by `uname -v` and /sys/kernel/realtime what may interrupt a real-time process."""
    if realtime == "1" or "PREEMPT_RT" in version.split():
        return Fact("kernel", "PREEMPT_RT", True)
    named = [word for word in version.split() if word.startswith("PREEMPT")]
    return Fact("kernel", named[0] if named else "no preemption named", False, "a PREEMPT_RT kernel")


def clock(source: str) -> Fact:
    """Judge the clock source."""
    return Fact("clock source", source or "not told", source in CLOCKS if source else None, "clocksource=tsc")


def host(share: float | None) -> Fact:
    """Judge the share of the cores' time that the host of a virtual machine has withheld."""
    if share is None:
        return Fact("host", "not told", None)
    found = f"has withheld {share:.3%} of the time" if share >= FAIR else f"less than {FAIR:.3%} withheld"
    advice = "a machine that is not virtual, or cores that its host keeps for it alone"
    return Fact("host", found, share < FAIR, advice, braking=True)


def receive_buffer(allowed: int | None) -> Fact:
    """Judge net.core.rmem_max, bytes: whether what is said to a recorder that is stopped may wait for it."""
    wanted = RECORDER.backlog_bytes
    found = "not told" if allowed is None else f"{allowed >> 10} KiB"
    good = None if allowed is None else allowed >= wanted
    return Fact("receive buffer", found, good, f"sysctl -w net.core.rmem_max={wanted}", timing=False)


def read_facts(missing: Sequence[str]) -> list[Fact]:
    """Return every fact of this machine."""
    sys_cpu, usable = Path("/sys/devices/system/cpu"), os.sched_getaffinity(0)
    allowed = _read(Path("/proc/sys/net/core/rmem_max"))
    governors = [_read(sys_cpu / f"cpu{core}" / "cpufreq" / "scaling_governor") for core in usable]
    return [
        *granted(missing),
        cores(len(usable), _read(sys_cpu / "isolated")),
        governor([name for name in governors if name]),
        kernel(platform.version(), _read(Path("/sys/kernel/realtime"))),
        host(stolen_share()),
        receive_buffer(int(allowed) if allowed else None),
        clock(_read(Path("/sys/devices/system/clocksource/clocksource0/current_clocksource"))),
    ]


def _read(path: Path) -> str:
    """Return the text of a file that may not be there."""
    try:
        return path.read_text().strip()
    except OSError:
        return ""
