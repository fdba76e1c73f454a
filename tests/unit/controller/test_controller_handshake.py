"""The controller learns which arm is there, and when it has left."""

import dataclasses
import logging
from typing import Any

import pytest

from protocol import messages as m
from protocol.codec import decode, encode
from services.controller.handshake import ArmHandshake, Departed, WrongRobot
from tests.unit.controller.stand_ins import CONFIG, NOISE, FakeBus, FakeClock, description, state

HALF_A_SECOND = 0.5


class Setup:
    """A handshake on a fake bus."""

    def __init__(self) -> None:
        self.bus, self.clock = FakeBus(), FakeClock()
        self.handshake = ArmHandshake(self.bus, CONFIG, logging.getLogger("controller"), self.clock)  # type: ignore[arg-type]
        self.handshake.open()

    @property
    def asked(self) -> list[str]:
        """The requests sent so far."""
        return [key for key, _ in self.bus.asked]

    def reply(self, body: bytes) -> None:
        """Answer the newest request."""
        self.bus.asked[-1][1](body)


@pytest.fixture
def setup() -> Setup:
    return Setup()


def test_an_arm_is_asked_until_it_has_answered(setup: Setup):
    """The controller asks for description and state; either reply may be lost, or refused by a busy arm."""
    assert setup.handshake.step() is None
    assert setup.asked == []
    setup.bus.see_arm()
    for count in (1, 2, 3):
        for _ in range(3):
            assert setup.handshake.step() is None
            assert setup.asked == ["description"] * count
        setup.clock.pass_by(HALF_A_SECOND)
    setup.reply(description("stepped"))
    assert setup.handshake.step() == decode(description("stepped"), m.Description)
    assert setup.asked[-1] == "state"
    setup.clock.pass_by(HALF_A_SECOND)
    setup.handshake.step()
    assert setup.asked[-1] == "description"
    setup.reply(description("stepped"))
    setup.handshake.step()
    setup.reply(encode(state(0)))
    assert setup.handshake.step() == state(0)
    asked = len(setup.asked)
    setup.clock.pass_by(10.0)
    assert setup.handshake.step() is None
    assert len(setup.asked) == asked


def test_an_arm_that_is_started_again_is_asked_again(setup: Setup):
    setup.bus.see_arm()
    setup.handshake.step()
    setup.reply(description("realtime"))
    setup.handshake.step()
    setup.reply(encode(state(7)))
    setup.handshake.step()
    assert setup.handshake.present
    setup.bus.see_arm(alive=False)
    assert not setup.handshake.present
    assert isinstance(setup.handshake.step(), Departed)
    assert setup.handshake.step() is None
    setup.bus.see_arm()
    setup.handshake.step()
    assert setup.handshake.present
    assert setup.asked == ["description", "state", "description"]


@pytest.mark.parametrize("expected", ["description", "state"])
def test_a_malformed_reply_ends_nothing(setup: Setup, expected: str, caplog: pytest.LogCaptureFixture):
    """On an open bus anybody may answer in the arm's place; the arm is asked again."""
    setup.bus.see_arm()
    setup.handshake.step()
    if expected == "state":
        setup.reply(description("realtime"))
        setup.handshake.step()
    assert setup.asked[-1] == expected
    setup.reply(NOISE)
    assert setup.handshake.step() is None
    assert [each.__dict__["code"] for each in caplog.records] == ["bad_message"]
    setup.clock.pass_by(HALF_A_SECOND)
    setup.handshake.step()
    assert setup.asked[-1] == "description"


@pytest.mark.parametrize("other", [{"joint_names": ["elbow"]}, {"rate_hz": 500.0}])
def test_another_arm_than_the_robot_config_describes_is_an_error(setup: Setup, other: dict[str, Any]):
    setup.bus.see_arm()
    setup.handshake.step()
    setup.reply(description("realtime", **other))
    with pytest.raises(WrongRobot, match="the robot config"):
        setup.handshake.step()


def test_an_arm_of_any_rate_is_accepted_by_its_own_config():
    """The description is compared with the given config, not with the shipped one."""
    bus, slow = FakeBus(), dataclasses.replace(CONFIG, rate_hz=100.0)
    handshake = ArmHandshake(bus, slow, logging.getLogger("controller"))  # type: ignore[arg-type]
    handshake.open()
    bus.see_arm()
    handshake.step()
    bus.asked[-1][1](description("realtime", slow))
    arm = handshake.step()
    assert isinstance(arm, m.Description)
    assert arm.rate_hz == 100.0
