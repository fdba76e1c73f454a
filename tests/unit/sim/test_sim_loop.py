"""What a simulation adds to the loop of the robot side."""

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
DEAF = SimpleNamespace(publisher=lambda *_, **__: SimpleNamespace(put=lambda _: None))


def test_what_is_wrong_with_the_robot_is_logged_at_the_start(caplog: pytest.LogCaptureFixture):
    """Nothing is wrong with the shipped arm."""
    log = logging.getLogger("sim")
    SimLoop(DEAF, ROBOT, "stepped", 0, log)  # type: ignore[arg-type]
    assert caplog.messages == []
    SimLoop(DEAF, replace(ROBOT, torques=np.array([500.0, 500.0, 1.0, 80.0, 80.0, 80.0])), "stepped", 0, log)  # type: ignore[arg-type]
    assert [record.levelname for record in caplog.records] == ["ERROR"]
    assert "joint_3 cannot hold the arm at home" in caplog.messages[0]


def test_stepped_runs_are_named_by_the_seed_and_then_in_order():
    """The same requests give the same names on any day."""
    loop = SimLoop(DEAF, ROBOT, "stepped", 7, logging.getLogger("sim"))  # type: ignore[arg-type]
    assert loop.drive.run == 7
    answers: list[m.Recovered] = []
    loop.handlers[topics.RECOVER.key](SimpleNamespace(reply=answers.append), m.Empty())  # type: ignore[arg-type]
    assert loop.deferred is not None
    assert loop.deferred.settle()
    assert [(answer.condition, answer.run) for answer in answers] == [("ready", 8)]
