"""What the controller publishes and logs besides its commands."""

import logging

import pytest

from protocol import messages as m
from services.controller.core import Controller
from services.controller.publications import Publications
from tests.unit.controller.stand_ins import CONFIG, FakeBus, FakeClock, state


class Desk:
    """The publications of a controller that has not received a state."""

    def __init__(self) -> None:
        self.core, self.bus, self.clock = Controller(CONFIG), FakeBus(), FakeClock()
        log = logging.getLogger("controller")
        self.publications = Publications(self.bus, self.core, log, self.clock)  # type: ignore[arg-type]


@pytest.fixture
def desk(caplog: pytest.LogCaptureFixture) -> Desk:
    caplog.set_level(logging.INFO)
    return Desk()


def test_before_the_first_state_there_is_no_status(desk: Desk):
    desk.publications.report()
    assert desk.bus.published["status"] == []


def test_the_status_is_published_every_20_ms_and_when_it_changes(desk: Desk):
    desk.core.answer(state(0), 0)
    desk.publications.report()
    counts = []
    for _ in range(40):
        desk.clock.pass_by(1e-3)
        desk.publications.report()
        counts.append(len(desk.bus.published["status"]))
    assert counts == [1] * 19 + [2] * 20 + [3]
    desk.core.raise_fault("hot")
    desk.publications.report()
    assert desk.bus.published["status"][3].fault == "hot"


def test_a_goal_that_ended_is_published_and_logged_with_its_id(desk: Desk, caplog: pytest.LogCaptureFixture):
    ended = m.Result(goal_id="g-1", outcome="succeeded", stamps=m.Stamps(requested=1, planned=2))
    desk.core.ledger.ended.append(ended)
    for _ in range(2):
        desk.publications.report()
    assert desk.bus.published["ended"] == [ended]
    assert [each.__dict__["goal_id"] for each in caplog.records] == ["g-1"]


def test_faults_are_logged_as_they_come_and_go(desk: Desk, caplog: pytest.LogCaptureFixture):
    """A fault's begin and end are logged once each, whether or not goals end with it."""
    desk.core.answer(state(0), 0)
    for fault in ("hot", "hot", None):
        desk.core.fault = fault
        desk.publications.report()
    assert caplog.messages == ["in fault: hot", "out of the fault"]
    assert caplog.records[0].__dict__["code"] == "fault"


def test_only_outside_of_real_time_a_publisher_waits(desk: Desk):
    """In real time a dead link must not block the loop; in other clocks no message may be lost."""
    assert desk.bus.blocking == {"command": False, "status": False, "ended": False}
    desk.publications.declare(blocking=True)
    assert desk.bus.blocking == {"command": True, "status": True, "ended": True}
