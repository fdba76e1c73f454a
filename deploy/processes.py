"""The table of processes: what `python -m services` starts, in this order, and stops in the reverse."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Process:
    """One service.

    `module` is run with `python -m`; `hosts_bus` tells who listens while the others connect; `flags` names the flags
    of its own that `python -m services` hands on.
    """

    name: str
    module: str
    hosts_bus: bool = False
    flags: tuple[str, ...] = ()


PROCESSES = (
    Process("sim", "services.sim", hosts_bus=True, flags=("clock", "seed")),
    Process("recorder", "services.recorder", flags=("record", "unindexed", "live", "live_port")),
    Process("planner", "services.planner", flags=("library", "lead")),
    Process("controller", "services.controller"),
)
"""The controller is stopped first, while the arm still answers it, and the sim last."""
