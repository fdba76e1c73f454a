"""CPU steal time per core, from /proc/stat: time in which a virtual machine's host ran something else on it."""

import os
from pathlib import Path

STEP_S = 1 / os.sysconf("SC_CLK_TCK")
"""Resolution of the kernel's counters, s, usually 0.01."""

KINDS = "user", "nice", "system", "idle", "iowait", "irq", "softirq", "steal"
_STEAL = KINDS.index("steal")


def stolen() -> dict[int, int]:
    """Return the steal time of each core of this process since boot, in steps of `STEP_S`.

    It is zero on real hardware, or if the host does not report it; the result is empty without /proc/stat.
    """
    usable = os.sched_getaffinity(0)
    return {core: times[_STEAL] for core, times in spent(_counts()).items() if core in usable}


def stolen_share() -> float | None:
    """Return steal as a fraction of all cores' time since boot, or None without /proc/stat."""
    times = spent(_counts()).values()
    total = sum(map(sum, times))
    return sum(core[_STEAL] for core in times) / total if total else None


def spent(counts: str) -> dict[int, list[int]]:
    """Return the time that each core has spent on each of `KINDS`, from the text of /proc/stat."""
    lines = (line.split() for line in counts.splitlines())
    cores = ((name.removeprefix("cpu"), fields) for name, *fields in filter(None, lines) if name.startswith("cpu"))
    return {int(core): [int(field) for field in fields[: len(KINDS)]] for core, fields in cores if core}


def _counts() -> str:
    try:
        return Path("/proc/stat").read_text()
    except OSError:
        return ""
