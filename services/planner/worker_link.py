"""The planner's link to a worker process that learns or plans."""

import logging
import os
import pickle
import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from motion.limits import Limits
from motion.sampled import SampledPlan
from protocol.errors import Refusal
from services.planner.worker import Failure, LearnedPrimitive, Task


class Worker:
    """A worker process with one role, started on first use and restarted after it died.

    process, connection: the running process and this end of its socket; None before it is started.
    """

    def __init__(self, role: str, limits: Limits, names: Sequence[str], log: logging.Logger) -> None:
        self.role = role
        self._arm = limits, tuple(names)
        self._log = log
        self.process: subprocess.Popen | None = None
        self.connection: Connection | None = None

    def learn(self, body: bytes | memoryview) -> LearnedPrimitive:
        """Return what is learned from the body of a `learn` request; for the role "learn".

        Raises:
            Refusal: the request is invalid; `unavailable` if the process died.
        """
        return self._ask(body)

    def plan(self, task: Task) -> SampledPlan:
        """Return the plan of a task; for the role "plan".

        Raises:
            Refusal: the task cannot be planned; `unavailable` if the process died.
        """
        return self._ask(pickle.dumps(task))

    def start(self) -> None:
        """Start the process before it is needed."""
        with suppress(OSError):
            self._connected()

    def _ask(self, body: bytes | memoryview) -> Any:
        try:
            connection = self._connected()
            connection.send_bytes(body)
            outcome = connection.recv()
        except (EOFError, OSError):
            self.close(died=True)
            sentence = f"the {self.role} process died; send this again"
            raise Refusal("unavailable", sentence, service="planner") from None
        if isinstance(outcome, Failure):
            if outcome.report:
                self._log.error("the %s process met an error of the planner\n%s", self.role, outcome.report)
            raise Refusal(outcome.code, outcome.message, **outcome.detail)
        return outcome

    def kill(self) -> None:
        """Kill the process, even while it works; in any thread."""
        if (process := self.process) is not None:
            process.kill()

    def close(self, *, died: bool = False) -> None:
        """End the process and clear it; `died`: it ended by itself, which is logged."""
        if self.process is not None:
            self.process.kill()
            status = self.process.wait()
            if died:
                self._log.info("the %s process died with status %s", self.role, status)
        if self.connection is not None:
            self.connection.close()
        self.process = self.connection = None

    def _connected(self) -> Connection:
        if self.process is not None and self.process.poll() is not None:
            self.close(died=True)
        if self.connection is not None:
            return self.connection
        ours, theirs = socket.socketpair()
        self.connection = Connection(ours.detach())
        with theirs:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "services.planner.worker", str(theirs.fileno()), self.role],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                start_new_session=True,  # in this session its niceness would count only among its own
                env=_environment(),
            )
        self.connection.send(self._arm)
        return self.connection


def _environment() -> dict[str, str]:
    """Return an environment with this process's module path and one BLAS thread: other cores belong to the loops."""
    path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)  # noqa: PTH109
    return {**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
