"""When the controller's loop answers requests, and the end of a client."""

import dataclasses
import threading
import time
from collections.abc import Callable

import pytest
from msgspec import structs

from protocol import messages as m
from protocol import topics
from protocol.errors import Refusal
from tests.unit.controller.running_loop import RunningLoop
from tests.unit.controller.stand_ins import CONFIG, Request, state, staying


def test_one_request_is_answered_each_tick(running: RunningLoop):
    """For any number of wake-ups within the tick."""
    running.turn(state(0))
    sent = [running.bus.request(topics.RESULT, m.ResultRequest(goal_id=goal_id)) for goal_id in "abc"]
    for tick in range(3):
        for _ in range(3):
            running.turn()
        assert [each.answer is not None for each in sent].count(True) == 1 + tick
        running.turn(state(tick + 1))


def test_requests_are_answered_while_the_arm_is_silent(running: RunningLoop):
    """One in every wait without a state, for any number of wake-ups within it."""
    running.turn(state(0))
    sent = [running.bus.request(topics.RESULT, m.ResultRequest(goal_id=goal_id)) for goal_id in "ab"]
    for expected in (1, 2):
        running.wait()
        for _ in range(3):
            running.turn()
            assert [each.answer is not None for each in sent].count(True) == expected


@pytest.mark.parametrize("clock", ["realtime", "paced", "stepped"])
def test_a_motion_does_not_overtake_the_states_that_came_before_it(
    start_loop: Callable[..., RunningLoop], clock: m.Clock
):
    """A client that has the reply to `guide` must not start a motion, also if the loop was about to take one."""
    running = start_loop(clock)
    running.turn(state(0))
    stream = running.bus.streams["state"]
    sent = running.bus.request(topics.EXECUTE, staying(30, 1))
    assert stream.take(10.0) is None  # the checked motion wakes the loop
    stream.wake()
    running.turn(state(0, condition="guiding"))
    assert isinstance(sent.answer, Refusal)
    assert sent.answer.code == "fault"


SLOW = dataclasses.replace(CONFIG, rate_hz=0.1)
"""An arm for whose state the loop waits for a dozen seconds."""


@pytest.mark.parametrize(
    ("topic", "body"),
    [
        (topics.CANCEL, m.Cancel()),
        (topics.STATUS_QUERY, m.Empty()),
        (topics.EXECUTE, staying(30, 1, config=SLOW)),
    ],
    ids=["stop", "question", "motion"],
)
def test_a_request_does_not_wait_for_the_next_state(
    start_loop: Callable[..., RunningLoop], topic: topics.Query, body: object
):
    """A request ends the wait for a state and is answered at once."""
    running = start_loop(config=SLOW)
    running.turn(state(5))
    sent = Request(topic, body)
    asker = threading.Timer(0.05, lambda: running.bus.inboxes[topic.key].offer(sent))
    began = time.monotonic()
    asker.start()
    while not sent.answer:
        running.turn()
    assert time.monotonic() - began < SLOW.tick
    asker.join()


def test_a_client_that_leaves_ends_the_motion_it_holds(running: RunningLoop):
    """When the token of the lease holder disappears, the loop stops the arm."""
    running.turn(state(0))
    running.bus.see_client("alice")
    running.turn(state(1))
    motion = structs.replace(staying(5, 1), client_id="alice", lease=True)
    assert isinstance(running.ask(topics.EXECUTE, motion), m.Accepted)
    running.bus.see_client("alice", alive=False)
    for tick in range(2, 10):
        running.turn(state(tick))
    assert [(result.goal_id, result.outcome) for result in running.bus.published["ended"]] == [("goal", "canceled")]
