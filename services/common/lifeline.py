"""Stop the services when their supervisor ends, even if it is killed.

Every service holds the write end of a pipe and reads two pipes: the supervisor's, and that of the service that stops
before it. The kernel closes the write ends of a process that ends for any reason. So the services detect that the
supervisor has ended, and stop one after another in the usual order: the controller brakes the arm while the sim still
runs. A service that was started by hand or by systemd reads no pipe.

A parent-death signal (`PR_SET_PDEATHSIG`) would reach all services at the same time, and already when the thread that
started them ends.
"""

import contextlib
import os
import select
import threading
from collections.abc import Sequence

VARIABLE = "VOLLEY_LIFELINE"
"""Environment variable with the descriptors that a service reads."""

ORDER_S = 3.0
"""Timeout for the service that stops before this one."""
ENDING_S = 5.0
"""Timeout for the service to end by itself afterwards."""


class Lifelines:
    """The supervisor's pipes: its own, and one for each process of `names`, in starting order."""

    def __init__(self, names: Sequence[str]) -> None:
        self._open = contextlib.ExitStack()
        self._supervisor, _ = self._pipe()
        self._pipes = [self._pipe() for _ in names]
        self._names = list(names)

    def given_to(self, name: str) -> tuple[list[int], dict[str, str]]:
        """Return the descriptors and the environment that tie process `name` to this one."""
        number = self._names.index(name)
        _, own = self._pipes[number]
        stops_before = [read for read, _ in self._pipes[number + 1 : number + 2]]
        reads = [self._supervisor, *stops_before]
        return [own, *reads], {**os.environ, VARIABLE: " ".join(map(str, reads))}

    def close(self) -> None:
        """Close the pipes; running processes that are tied to this one stop."""
        self._open.close()

    def _pipe(self) -> tuple[int, int]:
        ends = os.pipe()
        for end in ends:
            self._open.callback(os.close, end)
        return ends


def follow_supervisor(stopping: threading.Event) -> None:
    """Set `stopping` when the supervisor has ended, and kill this process if it still runs `ENDING_S` later.

    Does nothing in a process without a supervisor.
    """
    reads = [int(word) for word in os.environ.pop(VARIABLE, "").split()]
    if not reads:
        return
    supervisor, *stops_before = reads

    def watch() -> None:
        select.select([supervisor], [], [])
        if stops_before:
            select.select(stops_before, [], [], ORDER_S)
        if not stopping.is_set():
            stopping.set()
            threading.Event().wait(ENDING_S)
            os._exit(1)

    threading.Thread(target=watch, name="lifeline", daemon=True).start()
