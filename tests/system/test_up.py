"""`python -m services`, which is `volley up`: what it prints, and how all processes end with it."""

import contextlib
import ctypes
import os
import re
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from harness import SERVICES, joined, wait_for

from protocol import messages as m
from protocol import topics
from protocol.errors import Refusal
from services.common.cli import free_endpoint
from services.common.supervisor import READY_S
from tests.cores import LOOP_CORE
from tests.processes import is_running

ALL = len(SERVICES) + 1
PR_SET_CHILD_SUBREAPER = 36


@dataclass(frozen=True, slots=True)
class Up:
    """A running `python -m services`; all its processes print to `log`."""

    process: subprocess.Popen
    endpoint: str
    log: Path

    def said(self) -> str:
        """Return what was printed so far."""
        return self.log.read_text()

    def wait_ready(self) -> None:
        """Return once it prints that everything is ready."""
        wait_for(lambda: "volley is ready" in self.said(), "everything to be ready", READY_S)

    def descendants(self) -> list[int]:
        """Return the ids of all processes that it and its processes have started."""
        found = [self.process.pid]
        for pid in found:
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # it has ended meanwhile
                for task in Path(f"/proc/{pid}/task").iterdir():
                    with contextlib.suppress(FileNotFoundError, ProcessLookupError):
                        found += map(int, (task / "children").read_text().split())
        return found[1:]


def command(endpoint: str, scratch: Path, flag: str = "--listen") -> list[str]:
    """Return the command line, with files in `scratch`."""
    line = [sys.executable, "-m", "services", flag, endpoint, "--library", str(scratch / "library")]
    core = [] if LOOP_CORE is None else ["--loop-core", str(LOOP_CORE)]
    return [*line, "--record", str(scratch / "trace.rrd"), *core]


@contextlib.contextmanager
def up(scratch: Path, flag: str = "--listen") -> Iterator[Up]:
    """Start everything, and end it by Ctrl-C when the block ends."""
    endpoint, log = free_endpoint(), scratch / "log"
    with log.open("w") as output:
        process = subprocess.Popen(command(endpoint, scratch, flag), stdout=output, stderr=output)
    try:
        yield Up(process, endpoint, log)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(timeout=60.0)


def test_everything_from_start_to_ctrl_c(tmp_path: Path):
    """It prints the next steps, serves the arm on the paced clock with a live view on loopback, and ends with status 0.

    A second instance prints one sentence that names the first one, and starts nothing.
    """
    with up(tmp_path) as services:
        services.wait_ready()
        said = services.said()
        assert f"volley goal forehand --wait --connect {services.endpoint}" in said
        assert f"rerun {tmp_path / 'trace.rrd'}" in said
        found = re.search(r"http://(127\.0\.0\.1:(\d+))/\?url=\S+", said)
        assert found is not None, said
        wait_for(lambda: is_web_page(found[0]), "the web viewer to answer")
        assert listening_addresses(int(found[2])) == {"127.0.0.1"}
        with joined(services.endpoint) as bus:
            assert all(bus.is_alive(name) for name in (*SERVICES, "recorder"))
            with pytest.raises(Refusal) as caught:
                bus.ask(topics.SIM_STEP, m.Step(ticks=1))
            assert caught.value.code == "wrong_clock"
            assert bus.ask(topics.DESCRIPTION, m.Empty()).clock == "paced"
        second = refused(services.endpoint, tmp_path)
        assert second.count("\n") == 1
        assert f"robot arm runs already on {services.endpoint}; use it" in second
        started = services.descendants()
        assert len(started) == ALL + 1, "the services and the web viewer"
    assert services.process.returncode == 0, services.said()
    assert "Traceback" not in services.said()
    assert "ended with status" not in services.said()
    assert not any(map(is_running, started))
    assert (tmp_path / "trace.rrd").stat().st_size > 0


def is_web_page(address: str) -> bool:
    """Return whether the address serves a web page."""
    with contextlib.suppress(OSError), urllib.request.urlopen(address, timeout=5.0) as page:
        return b"<html" in page.read()
    return False


def listening_addresses(port: int) -> set[str]:
    """Return this machine's addresses on which a program listens on `port`."""
    rows = [line.split() for file in ("tcp", "tcp6") for line in Path(f"/proc/net/{file}").read_text().splitlines()[1:]]
    hexadecimal = {row[1].partition(":")[0] for row in rows if row[3] == "0A" and int(row[1].split(":")[1], 16) == port}
    return {socket.inet_ntop(socket.AF_INET, bytes.fromhex(text)[::-1]) for text in hexadecimal if len(text) == 8}


@pytest.mark.realtime
def test_a_killed_supervisor_takes_everything_with_it(tmp_path: Path):
    """Services, learner process and web viewer end after their supervisor is killed; the moving arm is stopped first.

    Every service ends by itself with status 0; one that took longer than 5 s would end with status 1.
    """
    with adopting_orphans(), up(tmp_path) as services:
        services.wait_ready()
        with joined(services.endpoint) as bus:
            samples = [[0.1 * k / 100, *5 * [0.0]] for k in range(100)]
            bus.ask(topics.LEARN, m.Learn(name="nod", positions=samples, rate=100.0))
            started = services.descendants()
            assert len(started) == ALL + 2, "the services, the process that learns, and the web viewer"
            reply = bus.ask(topics.GOAL, m.Goal(primitive="forehand", duration=3.0, goal_id="long"))
            wait_for(lambda: bus.ask(topics.STATE_QUERY, m.Empty()).time > reply.start_time + 0.5, "the arm to move")
            lines = {pid: Path(f"/proc/{pid}/cmdline").read_text().split("\0") for pid in started}
            services.process.kill()
            wait_for(lambda: not any(map(is_running, started)), "every process to end")
    pids = {name: pid for name in (*SERVICES, "recorder") for pid in started if f"services.{name}" in lines[pid]}
    statuses = {name: os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) for name, pid in pids.items()}
    assert statuses == dict.fromkeys((*SERVICES, "recorder"), 0)
    assert "goal long canceled" in services.said()
    assert "fell silent" not in services.said()


@contextlib.contextmanager
def adopting_orphans() -> Iterator[None]:
    """Adopt processes whose parent has ended, so that their exit statuses can be read."""
    libc = ctypes.CDLL(None)
    assert libc.prctl(PR_SET_CHILD_SUBREAPER, 1) == 0
    try:
        yield
    finally:
        libc.prctl(PR_SET_CHILD_SUBREAPER, 0)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
@pytest.mark.parametrize("flag", ["--listen", "--connect"])
def test_ended_while_everything_starts(tmp_path: Path, flag: str, number: signal.Signals):
    """A signal during the start leaves no process, even if the services are waiting for a bus."""
    with up(tmp_path, flag) as services:
        wait_for(lambda: len(services.descendants()) >= ALL, "the services to be started")
        started = services.descendants()
        services.process.send_signal(number)
        services.process.wait(timeout=60.0)
        wait_for(lambda: not any(map(is_running, started)), "every process to end")
    assert services.process.returncode == (-number if number is signal.SIGKILL else 0), services.said()
    assert "Traceback" not in services.said()
    assert "volley is ready" not in services.said()


def refused(endpoint: str, scratch: Path, *more: str, status: int = 1) -> str:
    """Start everything where that must fail, and return what is printed."""
    done = subprocess.run([*command(endpoint, scratch), *more], capture_output=True, text=True, check=False)
    assert done.returncode == status, done.stderr
    return done.stderr


def test_a_port_in_use_is_reported(tmp_path: Path):
    """One sentence says that another program listens on the port."""
    with socket.create_server(("127.0.0.1", 0)) as other:
        said = refused(f"tcp/127.0.0.1:{other.getsockname()[1]}", tmp_path)
    assert said.count("\n") == 1
    assert "another program listens on" in said
    assert "--listen" in said


def test_an_absent_robot_file_is_reported(tmp_path: Path):
    """One sentence names the file."""
    said = refused(free_endpoint(), tmp_path, "--robot-config", str(tmp_path / "absent.toml"), status=2)
    assert said.count("\n") == 1
    assert "absent.toml" in said


def test_an_incomplete_robot_file_is_reported(tmp_path: Path):
    """A sentence names what is missing, without a traceback."""
    config = tmp_path / "arm.toml"
    config.write_text('name = "arm"\n')
    said = refused(free_endpoint(), tmp_path, "--robot-config", str(config), status=2)
    assert "missing required field" in said
    assert "Traceback" not in said


def test_a_sim_that_cannot_start_is_reported_at_once(tmp_path: Path):
    """The supervisor does not wait for the router that the sim cannot host: its address belongs to another machine."""
    said = refused("tcp/192.0.2.1:7447", tmp_path, "--insecure")
    assert "volley: sim ended with status 1" in said


def test_services_started_by_hand_outlive_their_parent(tmp_path: Path):
    """A sim goes on after the shell that started it has ended."""
    endpoint, log = free_endpoint(), tmp_path / "log"
    line = f"{sys.executable} -m services.sim --listen {endpoint} < /dev/null > {log} 2>&1 & echo $!"
    pid = int(subprocess.run(["sh", "-c", line], capture_output=True, text=True, check=True).stdout)
    try:
        with joined(endpoint) as bus:
            wait_for(lambda: bus.is_alive("sim"), "the sim to be ready")
            assert is_running(pid)
    finally:
        os.kill(pid, signal.SIGTERM)
        wait_for(lambda: not is_running(pid), "the sim to end")
