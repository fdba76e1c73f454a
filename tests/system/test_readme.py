"""The README's commands do what it says."""

import base64
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import msgpack
import pytest

from protocol.bus.bus import Bus
from protocol.bus.sessions import DEFAULT_ENDPOINT, open_session
from services.common.cli import Options, free_endpoint
from services.common.supervisor import Supervisor, command_lines

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()


def blocks(language: str) -> list[str]:
    """Return the README's fenced blocks of `language`."""
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def lines(prefix: str) -> list[str]:
    """Return the shell lines of the README that begin with `prefix`."""
    return [line.strip() for block in blocks("sh") for line in block.splitlines() if line.startswith(prefix)]


@pytest.fixture(scope="module")
def endpoint(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The bus of services in real time. They forgive silence and plan far ahead: a busy machine fails no test here."""
    scratch = tmp_path_factory.mktemp("readme")
    shutil.copytree(ROOT / "deploy" / "robots", scratch / "robots")
    config = scratch / "robots" / "arm.toml"
    config.write_text(config.read_text().replace("silence_ticks = 20 ", "silence_ticks = 2000 "))
    endpoint = free_endpoint()
    flags = {"library": scratch / "library", "lead": 1.0}
    commands = command_lines(Options(robot_config=config, listen=(endpoint,)), flags)
    del commands["recorder"]
    with Supervisor(commands) as services, Bus(open_session([endpoint])) as bus:
        services.wait_ready(bus)
        yield endpoint


def run(command: list[str]) -> str:
    """Run a command with this environment's programs and return what it printed; it must succeed."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_make_targets_exist() -> None:
    """Every `make` command of the README is a target of the Makefile."""
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = {line.split()[1] for line in lines("make ")}
    assert named
    assert named <= targets


def test_services_take_the_flags_shown() -> None:
    """`python -m services` knows every flag that the README gives it."""
    shown = re.findall(r"python -m services (--[^`\n]*)", README)
    known = run([sys.executable, "-m", "services", "--help"])
    assert shown
    for flags in shown:
        assert all(flag in known for flag in shlex.split(flags) if flag.startswith("--"))


def test_client_lines_work(endpoint: str) -> None:
    """Every client command of the README succeeds; `watch`, which ends on Ctrl-C only, is told to help."""
    commands = lines("python -m tools.shell")
    assert len(commands) >= 3
    for line in commands:
        words = [sys.executable, *shlex.split(line)[1:]]
        run([*words, "--help"] if words[-1] == "watch" else [*words, "--connect", endpoint])


def test_ten_lines_of_python_send_a_goal(endpoint: str) -> None:
    """The bare client's block prints a reply, and imports nothing of the project."""
    (block,) = blocks("python")
    printed = run([sys.executable, "-I", "-c", block.replace(DEFAULT_ENDPOINT, endpoint)])
    assert "goal_id" in printed
    assert "code" not in printed


def test_zenoh_cli_sends_a_goal(endpoint: str) -> None:
    """The block with zenoh-cli prints a reply in base64."""
    (block,) = (block for block in blocks("sh") if "zenoh --mode" in block)
    printed = run(["bash", "-c", block.replace(DEFAULT_ENDPOINT, endpoint)])
    assert "goal_id" in msgpack.unpackb(base64.b64decode(printed.strip()))


def test_documents_linked_exist() -> None:
    """Every file that the README links to or shows is there."""
    linked = re.findall(r"\]\(([^)#]+)\)", README)
    assert linked
    assert [path for path in linked if not (ROOT / path).exists()] == []
