"""What the sim's loop logs."""

import logging
from types import SimpleNamespace

import pytest

from protocol import messages as m
from protocol.codec import encode
from robot.description import load_robot
from services.sim.loop import SimLoop


class Deaf:
    """A bus on which nobody hears."""

    def publisher(self, *_: object, **__: object) -> SimpleNamespace:
        """Let what is published go nowhere."""
        return SimpleNamespace(put=lambda _: None)


ROBOT = load_robot()
STILL = [0.0] * ROBOT.joint_count
OLD = m.Command(run=7, tick=0, source="test", accelerations=STILL, positions=STILL, velocities=STILL, goal_id=None)


@pytest.mark.parametrize("body", [b"\xc1", encode(OLD)])
def test_what_is_logged_of_a_refusal_has_its_code_as_a_field(body: bytes, caplog: pytest.LogCaptureFixture):
    """Whether a command does not decode, or is none for this run."""
    loop = SimLoop(Deaf(), ROBOT, "stepped", 0, logging.getLogger("sim"))  # type: ignore[arg-type]
    loop.hear(body)
    assert [each.__dict__["code"] for each in caplog.records] == ["bad_message"]
