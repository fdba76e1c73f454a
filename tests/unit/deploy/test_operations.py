"""`docs/operations.md`: its table is the permission table, and its commands are commands."""

import functools
import importlib
import re
import shlex
from pathlib import Path

import pytest
import tyro

import deploy
from deploy.zenoh.certificates import Authority
from deploy.zenoh.configure import SERVICES, Cell
from deploy.zenoh.permissions import ROLES, Role
from protocol.topics import PUBLICATIONS, QUERIES
from tools.shell.__main__ import COMMANDS, main

ROOT = Path(deploy.__file__).parents[1]
TEXT = (ROOT / "docs" / "operations.md").read_text()
COMMAND_LINES = re.findall(r"^    (\S.*)$", TEXT, re.MULTILINE)
PYTHON_LINES = [line for line in COMMAND_LINES if re.match(r"\S*\.venv/bin/python -m ", line)]
VOLLEY_LINES = [line for line in COMMAND_LINES if re.match(r"\S*\.venv/bin/volley ", line)]
INSTALLING = re.findall(r"^    (\S.*)$", TEXT.partition("## Installing")[2].partition("\n## ")[0], re.MULTILINE)
OWN_FLAGS = {
    "deploy.zenoh.certificates": Authority,
    "deploy.zenoh.configure": Cell,
}


def row(role: Role) -> str:
    """Return a role's line of the table."""
    keys = (
        [topic.key for topic in PUBLICATIONS if topic.owner == role.name],
        [topic.key for topic in QUERIES if topic.owner == role.name],
        [topic.key for topic in role.asks],
        role.tokens,
    )
    return (
        " | ".join([f"| `{role.name}`: {role.about}", *(", ".join(f"`{key}`" for key in group) for group in keys)])
        + " |"
    )


def test_the_table_is_the_permission_table():
    rows = [line for line in TEXT.splitlines() if line.startswith(tuple(f"| `{role.name}`:" for role in ROLES))]
    assert rows == [row(role) for role in ROLES]


@pytest.mark.parametrize("line", PYTHON_LINES)
def test_python_lines_parse(line):
    module, *words = shlex.split(line)[2:]
    flags = OWN_FLAGS.get(module) or importlib.import_module(f"{module}.__main__").Flags
    tyro.cli(flags, args=words)


@pytest.mark.parametrize("line", VOLLEY_LINES)
def test_volley_lines_parse(line, monkeypatch):
    name, *words = shlex.split(line)[1:]
    command = COMMANDS[name]
    if command.is_main:
        module = importlib.import_module(command.target.partition(":")[0])
        tyro.cli(module.Flags, args=words)
    else:
        idle = functools.wraps(command.load())(lambda *_, **__: 0)
        monkeypatch.setattr("tools.shell.__main__.Command.load", lambda _: idle)
        assert main([name, *words]) == 0


@pytest.mark.parametrize("line", [line for line in COMMAND_LINES if line.startswith("cp ")])
def test_copied_files_exist(line):
    source = shlex.split(line)[1].removeprefix("/opt/volley/")
    assert list(ROOT.glob(source)), source


def test_the_page_has_the_expected_number_of_commands():
    assert len(PYTHON_LINES) == 4
    assert len(VOLLEY_LINES) == 3
    assert len([line for line in COMMAND_LINES if line.startswith("cp ")]) == 3


def test_the_services_are_started_once_all_is_there():
    """Robot, certificates and configurations must exist, and systemd must know the units."""
    *before, daemon, last = INSTALLING
    assert (daemon, last) == ("systemctl daemon-reload", "systemctl enable --now volley@arm.target")
    for needed in ("arm.toml", "arm.xml", "deploy.zenoh.certificates", "deploy.zenoh.configure", "deploy/systemd"):
        assert any(needed in line for line in before), needed


def test_the_units_user_can_read_every_key():
    """No other user can."""
    (line,) = (line for line in INSTALLING if ".key" in line)
    command, _, keys = line.partition("~/volley-tls/")
    assert command.split() == ["install", "-o", "volley", "-g", "volley", "-m", "0400"]
    roles, _, rest = keys.removeprefix("{").partition("}")
    assert (set(roles.split(",")), rest) == (SERVICES, ".key /etc/volley/tls")
