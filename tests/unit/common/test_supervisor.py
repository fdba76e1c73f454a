"""Command lines from the process table, and processes that are started, awaited and ended."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from deploy.processes import PROCESSES, Process
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from services.common.cli import Options, free_endpoint
from services.common.supervisor import NotReady, Supervisor, command_lines

SLEEP = [sys.executable, "-c", "import time; time.sleep(60)"]


def after(line: list[str], flag: str) -> str:
    """Return the word after `flag`."""
    return line[line.index(flag) + 1]


@pytest.fixture
def bus() -> Iterator[Bus]:
    """Yield a bus of this test's own."""
    with Bus(open_session(listen=[free_endpoint()])) as bus:
        yield bus


def test_one_service_hosts_the_bus_and_the_others_connect():
    """They connect to the default endpoint or to the given one."""
    for options, endpoint in (
        (Options(), "tcp/127.0.0.1:7447"),
        (Options(listen=("tcp/127.0.0.1:9",)), "tcp/127.0.0.1:9"),
    ):
        lines = command_lines(options, {})
        assert list(lines) == [process.name for process in PROCESSES if not process.optional]
        assert after(lines["sim"], "--listen") == endpoint
        for name in ("planner", "controller", "recorder"):
            assert after(lines[name], "--connect") == endpoint
            assert "--listen" not in lines[name]


def test_on_an_existing_bus_all_connect():
    """The sim connects too."""
    for line in command_lines(Options(connect=("tcp/h:1", "tcp/h:2")), {}).values():
        assert line[line.index("--connect") + 1 :][:2] == ["tcp/h:1", "tcp/h:2"]
        assert "--listen" not in line


def test_flags_go_to_the_services_that_take_them(tmp_path: Path):
    """None and False leave a flag out, True is the flag alone, a path is a word."""
    flags = {"clock": "stepped", "seed": 0, "library": tmp_path, "lead": None, "live": True, "record": None}
    lines = command_lines(Options("left", tmp_path / "a.toml", (), (), tmp_path / "z.json5", loop_core=0), flags)
    for line in lines.values():
        assert after(line, "--robot") == "left"
        assert after(line, "--loop-core") == "0"
        assert after(line, "--robot-config") == str(tmp_path / "a.toml")
        assert after(line, "--zenoh-config") == str(tmp_path / "z.json5")
    assert (after(lines["sim"], "--clock"), after(lines["sim"], "--seed")) == ("stepped", "0")
    assert after(lines["planner"], "--library") == str(tmp_path)
    assert "--live" in lines["recorder"]
    assert not {"--lead", "--record"} & {word for line in lines.values() for word in line}
    assert "--clock" not in lines["planner"] + lines["controller"] + lines["recorder"]


def test_every_service_logs_in_the_same_form():
    """The form is the requested one, text by default."""
    for options, form in ((Options(), "text"), (Options(log="json"), "json")):
        assert {after(line, "--log") for line in command_lines(options, {}).values()} == {form}


@pytest.mark.parametrize("process", PROCESSES, ids=lambda process: process.name)
def test_every_command_line_is_understood(
    process: Process, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    """Each module accepts every flag that the table passes to it."""
    values = {
        "clock": "stepped",
        "seed": 1,
        "pace": 0.5,
        "also": ("x.toml", "y.toml"),
        "library": "x",
        "lead": 0.1,
        "record": "x.rrd",
        "live": True,
        "live_port": 9,
        "unindexed": True,
        "learned": "x.json",
        "method": "dmp",
    }
    flags = {name: values[name] for name in process.flags}
    line = command_lines(Options(), flags, [process.name])[process.name]
    assert line[:3] == [sys.executable, "-m", process.module]
    monkeypatch.setattr(sys, "argv", [process.module, *line[3:], "--help"])
    with pytest.raises(SystemExit) as ended:
        import_module(f"{process.module}.__main__").main()
    printed = capsys.readouterr()
    assert ended.value.code in (0, None), printed.err
    for name in process.flags:
        assert f"--{name.replace('_', '-')}" in printed.out


def test_processes_are_ended_in_the_reverse_order(tmp_path: Path):
    """Each ends by SIGTERM before the next one is stopped; Ctrl-C does not reach them directly."""
    log = tmp_path / "log"
    program = (
        "import pathlib, signal, sys\n"
        "log, name = pathlib.Path(sys.argv[1]), sys.argv[2]\n"
        "signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})\n"
        "(log.parent / name).touch()\n"
        "signal.sigwait({signal.SIGTERM})\n"
        "with log.open('a') as file: file.write(name)\n"
    )
    commands = {name: [sys.executable, "-c", program, str(log), name] for name in "abc"}
    with Supervisor(commands) as services:
        processes = list(services.running.values())
        while not all((tmp_path / name).exists() for name in "abc"):
            assert services.ended() == {}
        groups = {os.getpgid(process.pid) for process in processes}
        assert len(groups) == 3
    assert log.read_text() == "cba"
    assert [process.returncode for process in processes] == [0, 0, 0]
    assert services.running == {}


def test_if_one_process_cannot_be_started_the_others_are_ended():
    services = Supervisor({"slow": SLEEP, "absent": ["/no/such/program"]})
    with pytest.raises(FileNotFoundError), services:
        pass
    assert services.running == {}


def test_a_process_that_does_not_end_is_killed(monkeypatch: pytest.MonkeyPatch):
    """A process that ignores SIGTERM is killed after a timeout."""
    monkeypatch.setattr("services.common.supervisor.ENDING_S", 0.5)
    program = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print(flush=True); time.sleep(60)"
    services = Supervisor({})
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, start_new_session=True)
    assert process.stdout is not None
    process.stdout.readline()
    services.running["deaf"] = process
    services.stop()
    assert process.returncode == -signal.SIGKILL
    process.stdout.close()


def test_a_service_is_ready_once_it_holds_its_token(bus: Bus):
    """A process that merely runs is not ready."""
    with Supervisor({"slow": SLEEP}) as services:
        with pytest.raises(NotReady, match=r"slow did not become ready within 0 s"):
            services.wait_ready(bus, timeout=0.2)
        bus.announce("slow")
        services.wait_ready(bus)


def test_waiting_can_be_given_up(bus: Bus):
    """No error is raised, because the caller was asked to end."""
    answers = iter((False, True))
    with Supervisor({"slow": SLEEP}) as services:
        services.wait_ready(bus, give_up=lambda: next(answers))
    assert next(answers, None) is None


def test_a_process_that_ends_before_it_is_ready_is_an_error(bus: Bus):
    """The error names its status at once."""
    with Supervisor({"slow": SLEEP, "brief": [sys.executable, "-c", "raise SystemExit(3)"]}) as services:
        with pytest.raises(NotReady, match="brief ended with status 3"):
            services.wait_ready(bus)
        assert services.ended() == {"brief": 3}


def test_a_process_that_is_killed_before_it_is_ready_is_an_error(bus: Bus):
    """The error names the signal, because the log of a killed process does not."""
    with Supervisor({"slow": SLEEP}) as services:
        services.running["slow"].kill()
        services.running["slow"].wait()
        with pytest.raises(NotReady, match="slow was killed by signal 9"):
            services.wait_ready(bus)


def test_each_process_has_its_own_log_file(tmp_path: Path):
    """The file has the lines from before and after a restart."""
    line = [sys.executable, "-c", "import sys; sys.exit('out of oil')"]
    with Supervisor({"one": line}, logs=tmp_path) as services:
        services.running["one"].wait()
        services.start("one")
        services.running["one"].wait()
    assert (tmp_path / "one.log").read_text().split("\n")[:2] == ["out of oil"] * 2
