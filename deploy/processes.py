"""The table of processes: `volley up` (`python -m services`) starts them in this order and stops them in the reverse.

On a robot PC systemd starts them (`deploy/systemd`). The planner starts processes of its own: one that learns, and one
that plans goals of the method "gaussian".
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Process:
    """One service.

    `module` is run with `python -m`. The service with `hosts_bus` is the router: it listens, and the others connect to
    it. `flags` names the service's own flags that `volley up` passes on.
    """

    name: str
    module: str
    hosts_bus: bool = False
    flags: tuple[str, ...] = ()
    optional: bool = False


PROCESSES = (
    Process("sim", "services.sim", hosts_bus=True, flags=("clock", "seed", "pace", "also")),
    Process("recorder", "services.recorder", flags=("record", "unindexed", "live", "live_port")),
    Process("planner", "services.planner", flags=("library", "lead")),
    Process("striker", "services.striker", flags=("learned", "method"), optional=True),
    Process("controller", "services.controller"),
)
"""The controller stops first, while the sim still answers it, and the sim last."""
