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


class Desk:
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
def desk() -> Desk:
    return Desk()


def test_an_arm_is_asked_until_it_has_answered(desk: Desk):
    """The controller asks for description and state; either reply may be lost, or refused by a busy arm."""
    assert desk.handshake.step() is None
    assert desk.asked == []
    desk.bus.see_arm()
    for count in (1, 2, 3):
        for _ in range(3):
            assert desk.handshake.step() is None
            assert desk.asked == ["description"] * count
        desk.clock.pass_by(HALF_A_SECOND)
    desk.reply(description("stepped"))
    assert desk.handshake.step() == decode(description("stepped"), m.Description)
    assert desk.asked[-1] == "state"
    desk.clock.pass_by(HALF_A_SECOND)
    desk.handshake.step()
    assert desk.asked[-1] == "description"
    desk.reply(description("stepped"))
    desk.handshake.step()
    desk.reply(encode(state(0)))
    assert desk.handshake.step() == state(0)
    asked = len(desk.asked)
    desk.clock.pass_by(10.0)
    assert desk.handshake.step() is None
    assert len(desk.asked) == asked


def test_an_arm_that_is_started_again_is_asked_again(desk: Desk):
    desk.bus.see_arm()
    desk.handshake.step()
    desk.reply(description("realtime"))
    desk.handshake.step()
    desk.reply(encode(state(7)))
    desk.handshake.step()
    assert desk.handshake.present
    desk.bus.see_arm(alive=False)
    assert not desk.handshake.present
    assert isinstance(desk.handshake.step(), Departed)
    assert desk.handshake.step() is None
    desk.bus.see_arm()
    desk.handshake.step()
    assert desk.handshake.present
    assert desk.asked == ["description", "state", "description"]


@pytest.mark.parametrize("expected", ["description", "state"])
def test_a_malformed_reply_ends_nothing(desk: Desk, expected: str, caplog: pytest.LogCaptureFixture):
    """On an open bus anybody may answer in the arm's place; the arm is asked again."""
    desk.bus.see_arm()
    desk.handshake.step()
    if expected == "state":
        desk.reply(description("realtime"))
        desk.handshake.step()
    assert desk.asked[-1] == expected
    desk.reply(NOISE)
    assert desk.handshake.step() is None
    assert [each.__dict__["code"] for each in caplog.records] == ["bad_message"]
    desk.clock.pass_by(HALF_A_SECOND)
    desk.handshake.step()
    assert desk.asked[-1] == "description"


@pytest.mark.parametrize("other", [{"joint_names": ["elbow"]}, {"rate_hz": 500.0}])
def test_another_arm_than_the_robot_config_describes_is_an_error(desk: Desk, other: dict[str, Any]):
    desk.bus.see_arm()
    desk.handshake.step()
    desk.reply(description("realtime", **other))
    with pytest.raises(WrongRobot, match="the robot config"):
        desk.handshake.step()


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
