"""What a simulation adds to the loop of the robot side."""

import logging
from types import SimpleNamespace

from protocol import messages as m
from protocol import topics
from robot.description import load_robot
from services.sim.loop import SimLoop

ROBOT = load_robot()


def test_stepped_runs_are_named_by_the_seed_and_then_in_order():
    """The same requests give the same names on any day."""
    deaf = SimpleNamespace(publisher=lambda *_, **__: SimpleNamespace(put=lambda _: None))
    loop = SimLoop(deaf, ROBOT, "stepped", 7, logging.getLogger("sim"))  # type: ignore[arg-type]
    assert loop.drive.run == 7
    answers: list[m.Recovered] = []
    loop.handlers[topics.RECOVER.key](SimpleNamespace(decode=m.Empty, reply=answers.append))  # type: ignore[arg-type]
    assert loop.deferred is not None
    assert loop.deferred.settle()
    assert [(answer.condition, answer.run) for answer in answers] == [("ready", 8)]
