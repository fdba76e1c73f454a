"""The processes of a robot cell: signals, restarts, memory, logs."""

import signal
import time
from datetime import datetime
from pathlib import Path

from services.common.supervisor import Supervisor

LOG_TIME = "%Y-%m-%d %H:%M:%S,%f"
LOG_STEP_S = 1e-3
"""Resolution of the times in logs."""


class Processes:
    """Processes of a supervisor, with their logs in `folder`."""

    def __init__(self, supervisor: Supervisor, folder: Path) -> None:
        self._supervisor = supervisor
        self._folder = folder

    def signal(self, name: str, number: signal.Signals) -> float:
        """Send a signal to a process and return the Unix time, s."""
        sent = time.time()
        process = self._supervisor.running[name]
        process.send_signal(number)
        if number == signal.SIGKILL:
            process.wait()
        return sent

    def start(self, name: str) -> None:
        """Start a process in place of one that was killed or remains stopped."""
        self._supervisor.start(name)

    def pids(self) -> dict[str, int]:
        """Return the id of each process."""
        return {name: process.pid for name, process in self._supervisor.running.items()}

    def ended(self) -> int:
        """Return the number of processes that have exited without being stopped by the supervisor."""
        return len(self._supervisor.ended())

    def memory(self) -> dict[str, float]:
        """Return the resident memory of each process, MB."""

        def resident(pid: int) -> float:
            lines = Path(f"/proc/{pid}/status").read_text().splitlines()
            return next(int(line.split()[1]) / 1e3 for line in lines if line.startswith("VmRSS"))

        return {name: resident(pid) for name, pid in self.pids().items()}

    def log(self, name: str) -> Path:
        """Return the log file of a process."""
        return self._folder / f"{name}.log"

    def logged_at(self, name: str, words: str, after: float) -> float | None:
        """Return the time of the first log line with `words` at or after `after`, both Unix s, or None."""
        for line in self.log(name).read_text(errors="replace").splitlines():
            try:
                at = datetime.strptime(line[:23], LOG_TIME).timestamp()
            except ValueError:
                continue
            if words in line and at >= after - LOG_STEP_S:
                return at
        return None
