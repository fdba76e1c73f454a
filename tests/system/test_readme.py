"""The README's commands do what it says."""

import base64
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import msgpack
import pytest

from protocol.bus.sessions import DEFAULT_ENDPOINT
from services.common.cell import running_cell
from services.common.cli import Options
from tests.cores import LOOP_CORE
from tools.shell.__main__ import COMMANDS, main

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()


def blocks(language: str) -> list[str]:
    """Return the README's fenced blocks of `language`."""
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def lines(prefix: str) -> list[str]:
    """Return the shell lines of the README that begin with `prefix`."""
    return [line.strip() for block in blocks("sh") for line in block.splitlines() if line.startswith(prefix)]


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    """Yield the endpoint of running services on the default clock, which tolerates a busy machine."""
    with running_cell(Options(loop_core=LOOP_CORE), names=["sim", "planner", "controller"]) as cell:
        yield cell.endpoint


def run(command: list[str]) -> str:
    """Run a command with this environment's programs and return what it printed; it must succeed."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_make_targets_exist() -> None:
    """Every `make` command of the README is a target of the Makefile."""
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = {line.split()[1] for line in lines("make ")} | set(re.findall(r"`make ([a-z]+)`", README))
    assert named
    assert named <= targets


def test_up_takes_the_flags_shown() -> None:
    """`volley up` accepts every flag and value that the README shows with it."""
    shown = re.findall(r"volley up (--[^`\n]*)", README)
    known = run(["volley", "up", "--help"])
    assert shown
    for flags in shown:
        for word in shlex.split(flags):
            assert word in known or word.endswith(".toml"), word


def test_commands_named_exist() -> None:
    """Every `volley` command in the README's text exists."""
    named = set(re.findall(r"volley ([a-z]+)", README))
    assert {"up", "goal", "learn", "preflight", "drill"} <= named
    assert named <= set(COMMANDS)


def test_client_lines_work(endpoint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every command of the README succeeds; those that start something, or end on Ctrl-C only, are there."""
    commands = [shlex.split(line, comments=True)[1:] for line in lines("volley ")]
    asking = [words for words in commands if not COMMANDS[words[0]].is_main and words[0] != "watch"]
    assert len(asking) >= 3
    monkeypatch.chdir(ROOT)
    for words in asking:
        assert main([*words, "--connect", endpoint]) == 0, words


def test_lines_of_python_play_a_goal(endpoint: str) -> None:
    """The client library's block prints the outcome; the bare client's prints a reply without importing the project."""
    library, bare = (block.replace(DEFAULT_ENDPOINT, endpoint) for block in blocks("python"))
    assert run([sys.executable, "-c", library]).startswith("succeeded [")
    printed = run([sys.executable, "-I", "-c", bare])
    assert "goal_id" in printed
    assert "code" not in printed


def test_zenoh_cli_sends_a_goal(endpoint: str) -> None:
    """The block with zenoh-cli prints a reply in base64."""
    (block,) = (block for block in blocks("sh") if "zenoh --mode" in block)
    printed = run(["bash", "-c", block.replace(DEFAULT_ENDPOINT, endpoint)])
    assert "goal_id" in msgpack.unpackb(base64.b64decode(printed.strip()))


def test_documents_linked_exist() -> None:
    """Every file that the README links to or shows exists."""
    linked = re.findall(r"\]\(([^)#]+)\)", README)
    assert linked
    assert [path for path in linked if not (ROOT / path).exists()] == []
