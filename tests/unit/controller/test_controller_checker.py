"""The thread that checks trajectories beside the controller's loop."""

import logging
import threading
from collections.abc import Iterator

import numpy as np
import pytest
from msgspec import structs

from protocol import topics
from protocol.codec import matrix_bytes
from protocol.errors import Refusal
from protocol.topics import QUEUE_LENGTH
from services.common.stray_puts import StrayPuts
from services.controller.checker import TrajectoryChecker
from tests.unit.controller.stand_ins import CONFIG, FakeBus, Request, staying
from tools.drill.harness.waiting import eventually


class Setup:
    """A running checker, and how often it has woken its loop."""

    def __init__(self) -> None:
        self.bus, self.woken = FakeBus(), threading.Event()
        log = logging.getLogger("controller")
        puts = StrayPuts(self.bus, log)  # type: ignore[arg-type]
        self.checker = TrajectoryChecker(CONFIG, puts, log, self.woken.set)

    def send(self, body: object) -> Request:
        """Pass a request to the checker."""
        sent = Request(topics.EXECUTE, body)
        assert eventually(lambda: self.checker.requests.offer(sent))  # type: ignore[arg-type]
        return sent


@pytest.fixture
def setup() -> Iterator[Setup]:
    setup = Setup()
    setup.checker.start()
    yield setup
    setup.checker.close()


def test_a_valid_trajectory_is_passed_to_the_loop(setup: Setup):
    """It is checked but not answered yet; the loop is woken to splice and answer it."""
    sent = setup.send(staying(30, 1))
    assert setup.woken.wait(10.0)
    taken = setup.checker.take()
    assert taken is not None
    assert taken[0] is sent  # type: ignore[comparison-overlap]
    assert (taken[1].segment.start, taken[1].segment.end) == (30, 34)
    assert sent.answer is None
    assert setup.checker.take() is None


@pytest.mark.parametrize(
    "body", [structs.replace(staying(30, 1), count=0), Refusal("bad_message", "no msgpack", field="")]
)
def test_a_bad_trajectory_is_refused_at_once(setup: Setup, body: object):
    """The refusal covers bodies that do not decode and motions that cannot be played; the thread goes on."""
    sent = setup.send(body)
    assert eventually(lambda: sent.answer is not None)
    assert sent.answer.code == "bad_message"
    assert setup.checker.take() is None
    assert not setup.woken.is_set()
    setup.send(staying(30, 1))
    assert setup.woken.wait(10.0)


def test_a_value_given_by_its_index_is_followed_by_its_joint(setup: Setup):
    motion = staying(30, 1)
    values = np.zeros((motion.count, CONFIG.joint_count))
    values[3, 1] = np.nan
    motion = structs.replace(motion, velocities=matrix_bytes(values))
    sent = setup.send(motion)
    assert eventually(lambda: sent.answer is not None)
    name = CONFIG.joint_names[1]
    assert sent.answer.message.startswith(f"velocities[3][1] (joint {name}) is nan")
    assert sent.answer.detail == {"field": "velocities"}


def test_an_unexpected_error_is_answered_and_does_not_end_the_thread(setup: Setup, caplog: pytest.LogCaptureFixture):
    """The request is refused as `unavailable`, the log has the traceback, and the next trajectory is taken."""
    sent = setup.send("no trajectory")
    assert eventually(lambda: sent.answer is not None)
    assert (sent.answer.code, sent.answer.detail) == ("unavailable", {"service": "controller"})
    assert "AttributeError" in caplog.text
    setup.send(staying(30, 1))
    assert setup.woken.wait(10.0)


def test_more_trajectories_than_the_queue_holds_are_refused(setup: Setup):
    """The refusal names the goal that the loop could not take."""
    for k in range(QUEUE_LENGTH):
        setup.send(staying(30, 1, f"goal-{k}"))
    sent = setup.send(staying(30, 1, "too many"))
    assert eventually(lambda: sent.answer is not None)
    assert (sent.answer.code, sent.answer.detail) == ("busy", {"goal_id": "too many"})


def test_requests_sent_as_publications_are_logged(setup: Setup, caplog: pytest.LogCaptureFixture):
    setup.bus.puts = ["volley/arm/execute"]
    assert eventually(lambda: "something was put on volley/arm/execute" in caplog.text)
