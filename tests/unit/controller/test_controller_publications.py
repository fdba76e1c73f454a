"""What the controller publishes and logs besides its commands."""

import logging

import pytest

from protocol import messages as m
from services.controller.core import Controller
from services.controller.publications import Publications
from tests.unit.controller.stand_ins import CONFIG, FakeBus, FakeClock, state


class Setup:
    """The publications of a controller that has not received a state."""

    def __init__(self) -> None:
        self.core, self.bus, self.clock = Controller(CONFIG), FakeBus(), FakeClock()
        log = logging.getLogger("controller")
        self.publications = Publications(self.bus, self.core, log, self.clock)  # type: ignore[arg-type]


@pytest.fixture
def setup(caplog: pytest.LogCaptureFixture) -> Setup:
    caplog.set_level(logging.INFO)
    return Setup()


def test_before_the_first_state_there_is_no_status(setup: Setup):
    setup.publications.report()
    assert setup.bus.published["status"] == []


def test_the_status_is_published_every_20_ms_and_when_it_changes(setup: Setup):
    setup.core.answer(state(0), 0)
    setup.publications.report()
    counts = []
    for _ in range(40):
        setup.clock.pass_by(1e-3)
        setup.publications.report()
        counts.append(len(setup.bus.published["status"]))
    assert counts == [1] * 19 + [2] * 20 + [3]
    setup.core.raise_fault("hot")
    setup.publications.report()
    assert setup.bus.published["status"][3].fault == "hot"


def test_a_goal_that_ended_is_published_and_logged_with_its_id(setup: Setup, caplog: pytest.LogCaptureFixture):
    ended = m.Result(goal_id="g-1", outcome="succeeded", stamps=m.Stamps(requested=1, planned=2))
    setup.core.ledger.ended.append(ended)
    for _ in range(2):
        setup.publications.report()
    assert setup.bus.published["ended"] == [ended]
    assert [each.__dict__["goal_id"] for each in caplog.records] == ["g-1"]


def test_faults_are_logged_as_they_come_and_go(setup: Setup, caplog: pytest.LogCaptureFixture):
    """A fault's begin and end are logged once each, whether or not goals end with it."""
    setup.core.answer(state(0), 0)
    for fault in ("hot", "hot", None):
        setup.core.fault = fault
        setup.publications.report()
    assert caplog.messages == ["in fault: hot", "out of the fault"]
    assert caplog.records[0].__dict__["code"] == "fault"


def test_only_outside_of_real_time_a_publisher_waits(setup: Setup):
    """In real time a dead link must not block the loop; in other clocks no message may be lost."""
    assert setup.bus.blocking == {"command": False, "status": False, "ended": False}
    setup.publications.declare(blocking=True)
    assert setup.bus.blocking == {"command": True, "status": True, "ended": True}
