"""Additions of the simulation to the loop of the robot side."""

import logging
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from protocol import messages as m
from protocol import topics
from robot.description import load_robot
from services.sim.loop import SimLoop

ROBOT = load_robot()
NO_BUS = SimpleNamespace(publisher=lambda *_, **__: SimpleNamespace(put=lambda _: None))


def test_findings_about_the_robot_are_logged_at_the_start(caplog: pytest.LogCaptureFixture):
    """The shipped arm has none."""
    log = logging.getLogger("sim")
    SimLoop(NO_BUS, ROBOT, "stepped", 0, log)  # type: ignore[arg-type]
    assert caplog.messages == []
    SimLoop(NO_BUS, replace(ROBOT, torques=np.array([500.0, 500.0, 1.0, 80.0, 80.0, 80.0])), "stepped", 0, log)  # type: ignore[arg-type]
    assert [record.levelname for record in caplog.records] == ["ERROR"]
    assert "joint_3 cannot hold the arm at home" in caplog.messages[0]


def test_stepped_runs_are_numbered_from_the_seed():
    """The same requests give the same run numbers."""
    loop = SimLoop(NO_BUS, ROBOT, "stepped", 7, logging.getLogger("sim"))  # type: ignore[arg-type]
    assert loop.drive.run == 7
    answers: list[m.Recovered] = []
    loop.handlers[topics.RECOVER.key](SimpleNamespace(reply=answers.append), m.Empty())  # type: ignore[arg-type]
    assert loop.deferred is not None
    assert loop.deferred.settle()
    assert [(answer.condition, answer.run) for answer in answers] == [("ready", 8)]
