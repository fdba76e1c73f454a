"""What the host of a virtual machine withholds: while a core is away nothing runs there, not even an interrupt."""

import os
from pathlib import Path

STEP_S = 1 / os.sysconf("SC_CLK_TCK")
"""In which the kernel counts, usually 10 ms."""

_STOLEN = 7
"""Behind user, nice, system, idle, iowait, irq and softirq."""


def stolen() -> list[int]:
    """Return for how long each core has been withheld since the system's start, in steps of `STEP_S`.

    Zeros on a machine without a host; nothing where the kernel does not tell.
    """
    return [times[_STOLEN] for times in _times()]


def stolen_share() -> float | None:
    """Return the share of the cores' time since the system's start that was withheld; None where nobody tells."""
    times = _times()
    return sum(core[_STOLEN] for core in times) / sum(map(sum, times)) if times else None


def _times() -> list[list[int]]:
    """How each core has spent its time, as /proc/stat has it."""
    try:
        lines = Path("/proc/stat").read_text().splitlines()
    except OSError:
        return []
    return [[int(field) for field in line.split()[1:]] for line in lines if line[:3] == "cpu" and line[3] != " "]
