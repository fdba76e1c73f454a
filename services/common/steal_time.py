"""What the host of a virtual machine withholds: while a core is away nothing runs there, not even an interrupt."""

import os
from pathlib import Path

STEP_S = 1 / os.sysconf("SC_CLK_TCK")
"""In which the kernel counts, usually 10 ms."""

KINDS = "user", "nice", "system", "idle", "iowait", "irq", "softirq", "steal"
_STEAL = KINDS.index("steal")


def stolen() -> dict[int, int]:
    """Return for how long each core of this process has been withheld since the system's start, in steps of `STEP_S`.

    Zero where there is no host, or one that does not tell; empty where the kernel does not.
    """
    usable = os.sched_getaffinity(0)
    return {core: times[_STEAL] for core, times in spent(_counts()).items() if core in usable}


def stolen_share() -> float | None:
    """Return the share of all cores' time since the start that was withheld; None where the kernel does not tell."""
    times = spent(_counts()).values()
    total = sum(map(sum, times))
    return sum(core[_STEAL] for core in times) / total if total else None


def spent(counts: str) -> dict[int, list[int]]:
    """Return how each core has spent its time, by `KINDS`, from the text of /proc/stat."""
    lines = (line.split() for line in counts.splitlines())
    cores = ((name.removeprefix("cpu"), fields) for name, *fields in filter(None, lines) if name.startswith("cpu"))
    return {int(core): [int(field) for field in fields[: len(KINDS)]] for core, fields in cores if core}


def _counts() -> str:
    try:
        return Path("/proc/stat").read_text()
    except OSError:
        return ""
