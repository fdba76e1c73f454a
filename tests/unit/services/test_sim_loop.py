"""What the sim's loop logs."""

import logging
from types import SimpleNamespace

import pytest

from services.robot import load_robot
from services.sim.loop import SimLoop


class Deaf:
    """A bus on which nobody hears."""

    def publisher(self, *_: object, **__: object) -> SimpleNamespace:
        """Let what is published go nowhere."""
        return SimpleNamespace(put=lambda _: None)


def test_what_is_logged_of_a_refusal_has_its_code_as_a_field(caplog: pytest.LogCaptureFixture):
    loop = SimLoop(Deaf(), load_robot(), "stepped", 0, logging.getLogger("sim"))  # type: ignore[arg-type]
    loop._hear(b"\xc1")
    assert [each.__dict__["code"] for each in caplog.records] == ["bad_message"]
