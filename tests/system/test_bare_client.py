"""A client made of eclipse-zenoh and msgpack alone learns, plans, plays, cancels and forgets."""

import ast
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from harness import Stack

CLIENT = Path(__file__).with_name("bare_client.py")
HOME = [0.0, 0.52, 0.82, -0.2, 0.0, 0.09]


@pytest.fixture(scope="module")
def seen(services: Stack) -> dict[str, Any]:
    """Run the client in a Python that cannot import the project, and return what it observed."""
    services.reset()
    line = [sys.executable, "-I", str(CLIENT), services.endpoint]
    run = subprocess.run(line, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


def test_it_imports_nothing_of_the_project():
    """The client imports only Zenoh, msgpack and the standard library."""
    nodes = list(ast.walk(ast.parse(CLIENT.read_text())))
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
    packages = {name.partition(".")[0] for name in names}
    assert packages - sys.stdlib_module_names == {"msgpack", "zenoh"}


def test_it_learns_and_forgets(seen: dict[str, Any]):
    """The new primitive is in the library until it is forgotten."""
    assert seen["learned"]["name"] == "swing"
    assert seen["learned"]["duration"] == pytest.approx(199 / 200)
    assert seen["library"] == ["forehand", "swing"]
    assert seen["forgotten"] == "swing"
    assert seen["left"] == ["forehand"]


def test_it_plans_without_moving(seen: dict[str, Any]):
    """A plan-only goal is certified and sampled up to rest, and the arm does not move."""
    assert seen["certified"]
    assert seen["samples"] == round(seen["total_duration"] * 1000) + 1
    assert seen["before"] == pytest.approx(HOME, abs=1e-6)
    assert seen["after_planning"] == pytest.approx(HOME, abs=1e-6)


def test_it_plays_a_goal(seen: dict[str, Any]):
    """The goal is played up to rest, and its result has the errors at the hit."""
    first = seen["first"]
    assert first["outcome"] == "succeeded"
    assert max(map(abs, first["hit"]["position_error"])) < 1e-5
    assert max(map(abs, first["hit"]["velocity_error"])) < 1e-3
    assert first["stamps"]["requested"] < first["stamps"]["planned"] < first["stamps"]["first_command"]
    assert seen["at_goal"]["mode"] == "holding"
    assert seen["at_goal"]["feedback"]["positions"][0] < -0.6


def test_it_cancels_a_goal(seen: dict[str, Any]):
    """A cancelled arm comes to rest before the goal's end, and the result says so."""
    assert seen["canceled"]["goal_id"] == "second"
    assert seen["canceled"]["stop_time"] < seen["at_last"]["time"]
    assert seen["second"]["outcome"] == "canceled"
    assert seen["second"]["hit"] is None
    assert seen["at_last"]["mode"] == "holding"
    assert seen["at_last"]["goal_id"] is None
    assert max(map(abs, seen["at_last"]["feedback"]["velocities"])) < 1e-3
    assert seen["at_last"]["feedback"]["positions"][0] < -0.1


def test_it_follows_the_status(seen: dict[str, Any]):
    """The published modes include holding, tracking and stopping."""
    assert seen["modes"] == ["holding", "stopping", "tracking"]


def test_a_refusal_names_the_joint(seen: dict[str, Any]):
    """The refusal has the joint, the value and the bound, in its sentence and as data."""
    refused = seen["refused"]
    assert refused["code"] == "limit"
    assert refused["detail"]["joint"] == "joint_1"
    assert refused["detail"]["quantity"] == "position"
    assert refused["detail"]["value"] == 9.0
    assert f"at most {refused['detail']['bound']:.6g}" in refused["message"]
    assert "joint_1" in refused["message"]
