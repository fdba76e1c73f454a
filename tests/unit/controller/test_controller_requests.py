"""The order in which the controller answers requests."""

import logging
import threading
from collections.abc import Iterator

import pytest

from protocol import messages as m
from protocol import topics
from services.common.stray_puts import StrayPuts
from services.controller.checker import TrajectoryChecker
from services.controller.core import Controller
from services.controller.leases import ClientLeases
from services.controller.requests import Requests
from tests.unit.controller.stand_ins import CONFIG, FakeBus, state, staying


class Setup:
    """The requests to a controller that has answered one state."""

    def __init__(self) -> None:
        self.core, self.bus = Controller(CONFIG), FakeBus()
        self.core.answer(state(0), 0)
        self.woken = threading.Event()
        self.checked = threading.Event()
        log = logging.getLogger("controller")
        puts = StrayPuts(self.bus, log)  # type: ignore[arg-type]
        self.checker = TrajectoryChecker(CONFIG, puts, log, self.checked.set)
        leases = ClientLeases(self.core, log)
        self.requests = Requests(self.core, leases, self.checker, lambda: None, self.woken.set)
        self.requests.open(self.bus)  # type: ignore[arg-type]
        self.checker.start()


@pytest.fixture
def setup() -> Iterator[Setup]:
    setup = Setup()
    yield setup
    setup.checker.close()


def test_a_stop_goes_before_a_motion_and_a_motion_before_a_question(setup: Setup):
    """The order of arrival does not matter."""
    answered: list[str] = []
    status = setup.bus.request(topics.STATUS_QUERY, m.Empty())
    play = setup.bus.request(topics.EXECUTE, staying(30, setup.core.epoch))
    assert setup.checked.wait(10.0)
    stop = setup.bus.request(topics.CANCEL, m.Cancel())
    for sent in (status, play, stop):
        sent.answered = answered
    assert [setup.requests.answer_one() for _ in range(4)] == [True, True, True, False]
    assert answered == ["cancel", "execute", "status"]


def test_of_questions_the_first_goes_first(setup: Setup):
    answered: list[str] = []
    for topic, request in (
        (topics.RESULT, m.ResultRequest(goal_id="a")),
        (topics.STATUS_QUERY, m.Empty()),
        (topics.CANCEL, m.Cancel()),
    ):
        setup.bus.request(topic, request).answered = answered
    for _ in range(3):
        setup.requests.answer_one()
    assert answered == ["cancel", "result", "status"]


def test_each_request_is_answered_by_the_controller(setup: Setup):
    """The served topics are those that the topic table assigns to the controller."""
    assert set(setup.bus.inboxes) == {topic.key for topic in topics.QUERIES if topic.owner == "controller"}
    play = setup.bus.request(topics.EXECUTE, staying(30, setup.core.epoch))
    assert setup.checked.wait(10.0)
    assert setup.requests.answer_one()
    assert play.answer == m.Accepted(goal_id="goal", start_time=0.03)
    for topic, request, answer in (
        (topics.REFERENCE, m.ReferenceRequest(lead=0.0), m.Reference),
        (topics.RESULT, m.ResultRequest(goal_id="goal"), m.Result),
        (topics.STATUS_QUERY, m.Empty(), m.Status),
        (topics.CANCEL, m.Cancel(), m.Canceled),
    ):
        sent = setup.bus.request(topic, request)
        assert setup.requests.answer_one()
        assert isinstance(sent.answer, answer)
    reset = setup.bus.request(topics.RESET, m.Empty())
    assert setup.requests.answer_one()
    assert reset.answer.code == "busy"


def test_a_refusal_is_an_answer(setup: Setup):
    sent = setup.bus.request(topics.RESULT, m.ResultRequest(goal_id="nobody's"))
    assert setup.requests.answer_one()
    assert sent.answer.code == "unknown_goal"


@pytest.mark.parametrize(
    ("topic", "request_body"), [(topics.CANCEL, m.Cancel()), (topics.STATUS_QUERY, m.Empty())], ids=["stop", "question"]
)
def test_a_request_wakes_the_loop(setup: Setup, topic: topics.Query, request_body: object):
    """Otherwise a waiting loop would answer up to a tick later."""
    setup.bus.request(topic, request_body)
    assert setup.woken.is_set()
