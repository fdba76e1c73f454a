"""Facts about the machine from the operating system, each with advice; no privileges needed."""

import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from protocol.bus.sessions import RECORDER
from services.common.steal_time import stolen_share

CLOCKS = ("tsc", "kvm-clock", "arch_sys_counter")
"""Clock sources that can be read without a system call."""

FAIR = 1e-5
"""Acceptable share of stolen time: 36 ms an hour."""

CORES = 4
"""Cores needed: one for the sim or the robot's driver, one for the controller, two for the rest."""


@dataclass(frozen=True, slots=True)
class Fact:
    """One line of the table. `good` is None if the machine does not report it; `advice` says what would be better.

    `needed`: without it the machine is unfit for an arm, whatever the measurement shows. `timing`: it affects
    ticks. `braking`: if it is bad, an arm may brake occasionally.
    """

    name: str
    found: str
    good: bool | None
    advice: str = ""
    needed: bool = False
    timing: bool = True
    braking: bool = False


def granted(missing: Sequence[str]) -> tuple[Fact, Fact, Fact]:
    """Return the real-time rights as facts; `missing` is what `realtime.become_real_time` returned."""
    by_name = {sentence.split()[0].rstrip(":"): sentence for sentence in missing}
    scheduler, memory, slack = (by_name.get(name) for name in ("SCHED_FIFO", "mlockall", "timer"))
    return (
        Fact("scheduler", scheduler or "SCHED_FIFO", not scheduler, "LimitRTPRIO=60, or ulimit -r 60", needed=True),
        Fact("memory lock", memory or "mlockall", not memory, "LimitMEMLOCK=infinity, or ulimit -l unlimited", True),
        Fact("timer slack", slack or "1 ns", not slack),
    )


def cores(usable: int, isolated: str) -> Fact:
    """Judge the number of usable cores; `isolated` lists those without other processes (isolcpus)."""
    found = f"{usable} usable, isolated: {isolated or 'none'}"
    return Fact("cores", found, usable >= CORES, f"{CORES} or more, two of them isolated (isolcpus=2,3)")


def governor(names: Sequence[str]) -> Fact:
    """Judge the frequency governors of the cores; a virtual machine has none."""
    good = set(names) == {"performance"} if names else None
    return Fact("governor", ", ".join(sorted(set(names))) or "unknown", good, "cpupower frequency-set -g performance")


def kernel(version: str, realtime: str) -> Fact:
    """Judge the kernel's preemption by `uname -v` and /sys/kernel/realtime."""
    if realtime == "1" or "PREEMPT_RT" in version.split():
        return Fact("kernel", "PREEMPT_RT", True)
    named = [word for word in version.split() if word.startswith("PREEMPT")]
    return Fact("kernel", named[0] if named else "no preemption model named", False, "a PREEMPT_RT kernel")


def clock(source: str) -> Fact:
    """Judge the clock source."""
    return Fact("clock source", source or "unknown", source in CLOCKS if source else None, "clocksource=tsc")


def host(share: float | None) -> Fact:
    """Judge the CPU steal: the share of the cores' time that a virtual machine's host has taken."""
    if share is None:
        return Fact("host", "unknown", None)
    found = f"has stolen {share:.3%} of the time" if share >= FAIR else f"less than {FAIR:.3%} stolen"
    advice = "real hardware, or cores that the host dedicates to this machine"
    return Fact("host", found, share < FAIR, advice, braking=True)


def receive_buffer(allowed: int | None) -> Fact:
    """Judge net.core.rmem_max, bytes: whether a suspended recorder's messages fit into its socket."""
    wanted = RECORDER.backlog_bytes
    found = "unknown" if allowed is None else f"{allowed >> 10} KiB"
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
    """Return the text of a file, or an empty string if it does not exist."""
    try:
        return path.read_text().strip()
    except OSError:
        return ""
