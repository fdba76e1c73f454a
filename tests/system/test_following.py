"""The log lines of all services can be filtered by goal."""

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from harness import SERVICES, running

import deploy
from protocol import topics
from tools.demo.strikes import goal

OPERATIONS = Path(deploy.__file__).parents[1] / "docs" / "operations.md"
FOLLOWING = re.findall(r"^    .*jq -cR '(.*)'", OPERATIONS.read_text(), re.MULTILINE)
"""The page's jq filters, which select the lines of the goal `ID`."""


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return what each service logged while one goal was played and another one refused."""
    folder = tmp_path_factory.mktemp("logs")
    with running(folder, (*SERVICES, "recorder"), log="json", record=folder / "trace.rrd") as stack:
        stack.reset()
        reply = stack.bus.ask(topics.GOAL, goal(goal_id="played"))
        refusal = stack.refused_goal(primitive="forehand", positions=[0.0], goal_id="refused")
        assert refusal.code == "bad_message"
        assert stack.finish(reply).outcome == "succeeded"
    return {path.stem: path.read_text() for path in folder.glob("*.log")}


def lines(text: str) -> list[dict[str, Any]]:
    """Return the objects in a log."""
    return [json.loads(line) for line in text.splitlines()]


def test_every_line_is_an_object_of_its_service(logs: dict[str, str]):
    assert set(logs) == {*SERVICES, "recorder"}
    for service, text in logs.items():
        assert lines(text), service
        assert {line["service"] for line in lines(text)} == {service}


def test_a_goal_is_found_by_its_id(logs: dict[str, str]):
    """A played goal is in the lines of planner and controller; a refused one is in the planner's, with its code."""
    found = {
        (service, line["goal_id"], line["code"])
        for service, text in logs.items()
        for line in lines(text)
        if line["goal_id"]
    }
    assert found == {
        ("planner", "played", None),
        ("controller", "played", None),
        ("planner", "refused", "bad_message"),
    }


@pytest.mark.skipif(not shutil.which("jq"), reason="no jq on this machine")
def test_the_documented_filters_select_a_goal(logs: dict[str, str]):
    """The filters skip lines that are not JSON, such as those that systemd adds."""
    text = "Started Volley.\n" + "".join(logs.values())
    assert len(FOLLOWING) == 2
    for each in FOLLOWING:
        words = ["jq", "-cR", each.replace("ID", "played")]
        done = subprocess.run(words, input=text, capture_output=True, text=True, check=True)
        assert done.stderr == ""
        assert {line["service"] for line in lines(done.stdout)} == {"planner", "controller"}
