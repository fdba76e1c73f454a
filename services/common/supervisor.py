"""Start the services as processes, wait until they are ready, and end them in order."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Self

from deploy.processes import PROCESSES, Process
from protocol.bus.bus import Bus
from protocol.bus.sessions import DEFAULT_ENDPOINT
from services.common.cli import Options
from services.common.lifeline import Lifelines
from services.common.single_instance import Outcome

ENDING_S = 20.0
"""Timeout of a process to end after SIGTERM."""
READY_S = 180.0
"""Timeout of the processes to become ready, on a busy machine."""
LIVELINESS_S = 1.0
"""Timeout of one liveliness query, which is repeated."""
TAKEN = "one of this robot runs already on this bus: use it, end it, or choose another address with --listen"


class NotReady(Exception):
    """A service ended, or did not become ready in time; `str()` names it and the reason."""


def command_lines(
    options: Options, flags: Mapping[str, object], names: Sequence[str] | None = None
) -> dict[str, list[str]]:
    """Return the command line of every process that is not optional, or of those in `names`, in starting order.

    `flags` are values of the services' own flags by name; None and False leave a flag out. Without endpoints the
    host listens on the default one and the rest connect to it; with `options.connect` all join an existing bus. If
    the table's host is not among `names`, the first of them hosts the router.
    """
    endpoints = options.listen or options.connect or (DEFAULT_ENDPOINT,)
    chosen = [process for process in PROCESSES if (not process.optional if names is None else process.name in names)]
    host = next((process for process in chosen if process.hosts_bus), chosen[0])
    return {
        process.name: _command_line(process, options, endpoints, flags, process is host and not options.connect)
        for process in chosen
    }


def _command_line(
    process: Process, options: Options, endpoints: Sequence[str], flags: Mapping[str, object], hosting: bool
) -> list[str]:
    reach = {"listen": endpoints if hosting else (), "connect": () if hosting else endpoints}
    common = asdict(options) | reach | {"robot_config": options.robot_config.resolve()}
    line = [sys.executable, "-m", process.module]
    for name, value in {**common, **{name: flags.get(name) for name in process.flags}}.items():
        if value is None or value is False or value == ():
            continue
        words = value if isinstance(value, tuple) else () if value is True else (value,)
        line += [f"--{name.replace('_', '-')}", *map(str, words)]
    return line


class Supervisor:
    """The running processes, each in a separate process group, so that Ctrl-C reaches only this process.

    They stop in order when this process ends, even if it is killed. They log to this process's stderr, or to
    `NAME.log` in `logs`.
    """

    def __init__(self, commands: Mapping[str, Sequence[str]], logs: Path | None = None) -> None:
        self._commands = commands
        self._logs = logs
        self._lifelines = Lifelines(list(commands))
        self.running: dict[str, subprocess.Popen[bytes]] = {}

    def __enter__(self) -> Self:
        try:
            for name in self._commands:
                self.start(name)
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self, name: str) -> None:
        """Start the process called `name`."""
        descriptors, environment = self._lifelines.given_to(name)
        with contextlib.ExitStack() as files:
            log = files.enter_context((self._logs / f"{name}.log").open("ab")) if self._logs else None
            self.running[name] = subprocess.Popen(
                self._commands[name],
                stdin=subprocess.DEVNULL,
                stderr=log,
                start_new_session=True,
                pass_fds=descriptors,
                env=environment,
            )

    def wait_ready(self, bus: Bus, timeout: float = READY_S, give_up: Callable[[], bool] = lambda: False) -> None:
        """Wait until every process holds its liveliness token, or `give_up`, called 20 times a second, returns True.

        Raises:
            NotReady: a process ended, or `timeout` s have passed.
        """
        deadline = time.monotonic() + timeout
        waiting = list(self.running)
        while waiting and not give_up():
            self.check_running()
            if time.monotonic() > deadline:
                raise NotReady(f"{' and '.join(waiting)} did not become ready within {timeout:.0f} s")
            waiting = [name for name in waiting if not bus.is_alive(name, LIVELINESS_S)]
            time.sleep(0.05)

    def check_running(self) -> None:
        """Raise NotReady if a process has ended."""
        ended = self.ended()
        if ended:
            raise NotReady("; ".join(self._reason(name, status) for name, status in ended.items()))

    def ended(self) -> dict[str, int]:
        """Return the exit status of every process that has ended."""
        statuses = {name: process.poll() for name, process in self.running.items()}
        return {name: status for name, status in statuses.items() if status is not None}

    def stop(self) -> None:
        """End the processes one after another, in reverse starting order."""
        for name in reversed(list(self.running)):
            process = self.running.pop(name)
            _signal_group(process, signal.SIGTERM)
            try:
                process.wait(ENDING_S)
            except subprocess.TimeoutExpired:
                _signal_group(process, signal.SIGKILL)
                process.wait()
        self._lifelines.close()

    def _reason(self, name: str, status: int) -> str:
        """Return a sentence about a process that has ended: the meaning of its status, or the last line of its log."""
        if status == Outcome.TAKEN:
            return f"{name} {ending(status)}: {TAKEN}"
        lines = (self._logs / f"{name}.log").read_text(errors="replace").splitlines() if self._logs else []
        return f"{name} {ending(status)}" + (f": {lines[-1]}" if lines else "; its log says why")


def ending(status: int) -> str:
    """Return in words how a process ended, from its exit status in `subprocess`."""
    return f"was killed by signal {-status}" if status < 0 else f"ended with status {status}"


def _signal_group(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    if process.poll() is None:
        os.killpg(process.pid, number)
