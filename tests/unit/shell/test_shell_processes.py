"""Processes of the command that are interrupted, or whose reader is gone."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from protocol.topics import STATUS
from tests.golden.examples import EXAMPLES
from tools.drill.harness.waiting import PATIENCE_S, eventually
from tools.shell.__main__ import Command, main


@pytest.mark.parametrize(
    ("words", "terminal", "shown", "number"),
    [
        ([], "1", b"tracking", signal.SIGINT),
        ([], "1", b"tracking", signal.SIGTERM),
        (["--json"], "0", b"tracking", signal.SIGINT),
        ([], "0", b"events", signal.SIGTERM),
    ],
)
def test_watch_ends_cleanly_on_a_signal(robot, router, words, terminal, shown, number):
    """After it has shown a status; without a terminal it prints only the last screen."""
    publisher = router.publishers[STATUS.key]
    command = [Path(sys.executable).with_name("volley"), "watch", "--connect", router.endpoint, *words]
    environment = os.environ | {"PYTHONUNBUFFERED": "1", "TTY_COMPATIBLE": terminal}
    listened = router.bus.session.declare_publisher(router.bus.key(STATUS.key))
    assert eventually(lambda: not listened.matching_status.matching), "the process of another test still listens"
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment) as process:
        try:
            assert eventually(lambda: listened.matching_status.matching)
            output, printed = process.stdout, b""
            assert output is not None
            os.set_blocking(output.fileno(), False)

            def has_shown() -> bool:
                nonlocal printed
                publisher.put(EXAMPLES["Status"])
                printed += output.read() or b""
                return shown in printed

            if shown == b"tracking":
                assert eventually(has_shown)
            process.send_signal(number)
            os.set_blocking(output.fileno(), True)
            rest, complained = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    assert (process.returncode, complained) == (0, b"")
    assert shown in printed + rest


RECORDING = "deploy/demonstrations/forehand.csv"


@pytest.mark.parametrize("words", [["--help"], ["goal", "--help"], ["episodes", RECORDING]])
def test_a_closed_pipe_prints_no_error(words):
    """For example in `volley goal --help | head -1`."""
    reading, writing = os.pipe()
    os.close(reading)
    command = [Path(sys.executable).with_name("volley"), *words]
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")


def test_ctrl_c_while_a_command_is_loaded_is_no_error(monkeypatch, capsys):
    """Imports take seconds on a busy machine."""

    def interrupt(command):
        raise KeyboardInterrupt

    monkeypatch.setattr(Command, "load", interrupt)
    try:
        status = main(["inspect", RECORDING])
    except KeyboardInterrupt:  # would end pytest
        status = None
    assert (status, *capsys.readouterr()) == (130, "", "")
