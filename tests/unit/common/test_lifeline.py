"""Processes that end because the process that started them was killed."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from services.common.lifeline import VARIABLE, follow_supervisor
from tests.processes import is_running
from tools.drill.harness.waiting import PATIENCE_S, eventually

SERVICE = """
import os, sys, time
from pathlib import Path
from services.common import lifeline
from services.common.signals import stop_on_signals
log, name = Path(sys.argv[1]), sys.argv[2]
lifeline.ORDER_S, lifeline.ENDING_S = float(sys.argv[3]), 60.0
stopping = stop_on_signals()
assert "VOLLEY_LIFELINE" not in os.environ, "processes of its own would read what is not theirs"
(log.parent / name).touch()
stopping.wait()
time.sleep(0.2)
with log.open("a") as file: file.write(name)
"""
SUPERVISOR = """
import sys, time
from services.common.supervisor import Supervisor
commands = {name: [sys.executable, "-c", *sys.argv[1:3], name, sys.argv[3]] for name in "abc"}
with Supervisor(commands) as services:
    print(*(process.pid for process in services.running.values()), flush=True)
    time.sleep(60)
"""


def start(log: Path, order_s: float) -> tuple[subprocess.Popen, list[int]]:
    """Start a supervisor of three processes; return it and their ids once they run.

    Each process waits up to `order_s` for the one that stops before it, and then takes its time to end.
    """
    line = [sys.executable, "-c", SUPERVISOR, SERVICE, str(log), str(order_s)]
    supervisor = subprocess.Popen(line, stdout=subprocess.PIPE, text=True)
    assert supervisor.stdout is not None
    with supervisor.stdout as printed:
        pids = [int(word) for word in printed.readline().split()]
    assert eventually(lambda: all((log.parent / name).exists() for name in "abc"))
    return supervisor, pids


def test_a_killed_supervisor_takes_its_processes_with_it(tmp_path: Path):
    """Processes end in the order in which the supervisor would have stopped them."""
    supervisor, pids = start(tmp_path / "log", order_s=PATIENCE_S)
    supervisor.kill()
    supervisor.wait()
    assert eventually(lambda: not any(map(is_running, pids)))
    assert (tmp_path / "log").read_text() == "cba"


def test_a_suspended_process_delays_the_others_by_a_bounded_time(tmp_path: Path):
    """The process that was started last is suspended and cannot end; the others end after 1 s."""
    supervisor, pids = start(tmp_path / "log", order_s=1.0)
    os.kill(pids[-1], signal.SIGSTOP)
    began = time.monotonic()
    supervisor.kill()
    supervisor.wait()
    assert eventually(lambda: not any(map(is_running, pids[:-1])))
    assert time.monotonic() - began > 1.0
    os.kill(pids[-1], signal.SIGCONT)
    assert eventually(lambda: not is_running(pids[-1]))


def test_a_service_started_by_hand_has_no_lifeline(monkeypatch: pytest.MonkeyPatch):
    """Without a supervisor no thread is started, and the event is not set."""
    monkeypatch.delenv(VARIABLE, raising=False)
    stopping, before = threading.Event(), threading.active_count()
    follow_supervisor(stopping)
    assert threading.active_count() == before
    assert not stopping.is_set()
