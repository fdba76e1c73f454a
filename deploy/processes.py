"""The table of processes: what `python -m services` starts, in this order, and stops in the reverse."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Process:
    """One service.

    `module` is run with `python -m`. The service with `hosts_bus` listens, and the others connect to it. `flags` names
    the service's own flags that `python -m services` hands on.
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
"""The controller stops first, while the sim still answers it, and the sim last."""
