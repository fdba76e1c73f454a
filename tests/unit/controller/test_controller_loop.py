"""The controller's loop with noise, silence, requests and every clock."""

import dataclasses
import logging
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from msgspec import structs

from protocol import messages as m
from protocol import topics
from protocol.codec import encode
from robot.description import RobotConfig
from services.controller.handshake import WrongRobot
from services.controller.loop import ControllerLoop
from tests.unit.controller.stand_ins import CONFIG, NOISE, FakeBus, FakeClock, Request, description, state, staying
from tests.waiting import PATIENCE_S

A_WAIT = 1.3
"""Ticks; longer than the controller waits for a state."""


class Desk:
    """A loop whose arm has described itself."""

    def __init__(self, arm_clock: m.Clock, config: RobotConfig, clock: Callable[[], int] | None) -> None:
        self.bus, self.clock, self.config = FakeBus(), FakeClock(), config
        log = logging.getLogger("controller")
        self.loop = ControllerLoop(self.bus, config, log, clock or self.clock)  # type: ignore[arg-type]
        self.loop.open()
        self.bus.see_arm()
        self.loop.turn()
        self.bus.asked[-1][1](description(arm_clock, config))
        self.bus.streams["state"].wake()
        self.loop.turn()

    @property
    def answered(self) -> list[int]:
        """The ticks of all commands."""
        return [command.tick for command in self.bus.published["command"]]

    @property
    def fault(self) -> str | None:
        """The fault in the newest status."""
        statuses = self.bus.published["status"]
        return statuses[-1].fault if statuses else None

    def turn(self, *states: m.State | bytes) -> None:
        """Run the loop once, after these messages have arrived."""
        for each in states:
            self.bus.send(each if isinstance(each, bytes) else encode(each))
        self.loop.turn()

    def wait(self, *states: m.State | bytes) -> None:
        """Run the loop through one wait, in which these messages arrive."""
        self.clock.pass_by(A_WAIT * self.config.tick)
        self.turn(*states)

    def ask(self, topic: topics.Query, request: Any) -> Any:
        """Return the loop's answer to a request, before the next tick."""
        sent = self.bus.request(topic, request)
        while sent.answer is None:
            self.turn()
        return sent.answer

    def close(self) -> None:
        """End the loop and its thread at once."""
        self.clock.creep_ns = 1_000_000_000_000
        self.loop.close()


@pytest.fixture
def desks() -> Iterator[Callable[..., Desk]]:
    """Make desks, whose threads end with the test."""
    made: list[Desk] = []

    def make(
        arm_clock: m.Clock = "realtime", config: RobotConfig = CONFIG, clock: Callable[[], int] | None = None
    ) -> Desk:
        made.append(Desk(arm_clock, config, clock))
        return made[-1]

    yield make
    for desk in made:
        desk.close()


@pytest.fixture
def desk(desks: Callable[..., Desk]) -> Desk:
    """A loop in real time."""
    return desks()


def test_a_state_followed_by_malformed_ones_is_answered(desk: Desk):
    """The newest good state is answered, and what was refused is counted, once each."""
    desk.turn(state(5))
    desk.turn(state(6), state(7), NOISE, state(3), b"")
    assert desk.answered == [5, 7]
    assert desk.ask(topics.STATUS_QUERY, m.Empty()).cycle.refused == 3


@pytest.mark.parametrize(
    "bad",
    [state(5), state(3), state(6, positions=[0.0]), state(6, truth=m.Point(positions=[], velocities=[])), NOISE],
    ids=["doubled", "old", "short", "truth", "noise"],
)
def test_a_state_that_is_not_answered_is_counted_once(desk: Desk, bad: m.State | bytes):
    desk.turn(state(5))
    desk.turn(bad)
    assert desk.answered == [5]
    assert desk.ask(topics.STATUS_QUERY, m.Empty()).cycle.refused == 1


def test_malformed_states_do_not_end_the_silence(desk: Desk, caplog: pytest.LogCaptureFixture):
    """Every wait without a valid state counts as silent, and the twentieth is a fault."""
    desk.turn(state(5))
    for wait in range(1, CONFIG.silence_ticks + 1):
        assert desk.fault is None
        desk.wait(NOISE, NOISE)
        assert (desk.fault is not None) == (wait == CONFIG.silence_ticks)
    assert desk.fault == "no state for 20 ticks"
    assert "the arm fell silent" in caplog.text


def test_a_state_ends_the_silence(desk: Desk):
    """The count starts again at 0."""
    desk.turn(state(5))
    for tick in (6, 7):
        for _ in range(CONFIG.silence_ticks - 1):
            desk.wait()
        desk.turn(state(tick))
    assert desk.fault is None


def test_within_a_wait_nothing_is_counted(desk: Desk):
    """If noise ends a wait early, the loop waits for the rest of it."""
    desk.turn(state(5))
    for _ in range(2 * CONFIG.silence_ticks):
        desk.turn(NOISE)
        desk.turn()
    assert desk.fault is None


def test_a_refusal_is_logged_with_its_code(desk: Desk, caplog: pytest.LogCaptureFixture):
    desk.turn(NOISE)
    assert [each.__dict__["code"] for each in caplog.records] == ["bad_message"]


def test_the_state_that_the_arm_was_asked_for_is_answered(desk: Desk):
    """It is not answered if the stream has brought it, or a newer one, meanwhile."""
    answer = desk.bus.asked[-1][1]
    assert desk.bus.asked[-1][0] == "state"
    answer(encode(state(0)))
    desk.turn()
    assert desk.answered == [0]
    desk.turn(state(1))
    answer(encode(state(0)))
    desk.turn()
    answer(encode(state(2)))
    desk.turn()
    assert desk.answered == [0, 1, 2]


def test_another_arm_ends_the_loop(desk: Desk):
    desk.bus.see_arm()
    desk.turn()
    desk.bus.asked[-1][1](description("realtime", joint_names=["elbow"]))
    with pytest.raises(WrongRobot):
        desk.loop.run(threading.Event())


# --- requests -----------------------------------------------------------------------------------------


def test_one_request_is_answered_each_tick(desk: Desk):
    """For any number of wake-ups within the tick."""
    desk.turn(state(0))
    sent = [desk.bus.request(topics.RESULT, m.ResultRequest(goal_id=goal_id)) for goal_id in "abc"]
    for tick in range(3):
        for _ in range(3):
            desk.turn()
        assert [each.answer is not None for each in sent].count(True) == 1 + tick
        desk.turn(state(tick + 1))


def test_requests_are_answered_while_the_arm_is_silent(desk: Desk):
    """One in every wait without a state, for any number of wake-ups within it."""
    desk.turn(state(0))
    sent = [desk.bus.request(topics.RESULT, m.ResultRequest(goal_id=goal_id)) for goal_id in "ab"]
    for expected in (1, 2):
        desk.wait()
        for _ in range(3):
            desk.turn()
            assert [each.answer is not None for each in sent].count(True) == expected


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
def test_a_request_does_not_wait_for_the_next_state(desks: Callable[..., Desk], topic: topics.Query, body: object):
    """A request ends the wait for a state and is answered at once."""
    desk = desks(config=SLOW)
    desk.turn(state(5))
    sent = Request(topic, body)
    asker = threading.Timer(0.05, lambda: desk.bus.inboxes[topic.key].offer(sent))
    began = time.monotonic()
    asker.start()
    while not sent.answer:
        desk.turn()
    assert time.monotonic() - began < SLOW.tick
    asker.join()


def test_a_client_that_leaves_ends_the_motion_it_holds(desk: Desk):
    """When the token of the lease holder disappears, the loop stops the arm."""
    desk.turn(state(0))
    desk.bus.see_client("alice")
    desk.turn(state(1))
    motion = structs.replace(staying(5, 1), client_id="alice", lease=True)
    assert isinstance(desk.ask(topics.EXECUTE, motion), m.Accepted)
    desk.bus.see_client("alice", alive=False)
    for tick in range(2, 10):
        desk.turn(state(tick))
    assert [(result.goal_id, result.outcome) for result in desk.bus.published["ended"]] == [("goal", "canceled")]


# --- clocks -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("arm_clock", ["stepped", "paced"])
def test_outside_of_real_time_each_state_is_answered(desks: Callable[..., Desk], arm_clock: m.Clock):
    """The loop answers one state a turn with a blocking publisher, because the arm waits for the answer."""
    desk = desks(arm_clock)
    desk.turn(state(0), state(1))
    assert desk.answered == [0]
    desk.turn()
    assert desk.answered == [0, 1]
    assert desk.bus.blocking == {"command": True, "status": True, "ended": True}


def test_in_real_time_the_newest_state_is_answered(desk: Desk):
    """The publisher drops what cannot be sent at once."""
    desk.turn(state(0), state(1))
    assert desk.answered == [1]
    assert desk.bus.blocking == {"command": False, "status": False, "ended": False}


@pytest.mark.parametrize("arm_clock", ["stepped", "paced"])
def test_outside_of_real_time_slow_states_are_no_fault(desks: Callable[..., Desk], arm_clock: m.Clock):
    desk = desks(arm_clock)
    desk.turn(state(0))
    for _ in range(3 * CONFIG.silence_ticks):
        desk.wait()
    assert desk.fault is None


def test_in_paced_time_an_arm_that_is_gone_aborts_the_motion(desks: Callable[..., Desk]):
    """A new run of the arm ends the fault."""
    desk = desks("paced")
    desk.turn(state(0))
    desk.ask(topics.EXECUTE, staying(5, 1))
    desk.bus.see_arm(alive=False)
    desk.turn()
    assert desk.fault == "the arm is gone: its token alive/sim disappeared from the bus"
    assert [result.outcome for result in desk.bus.published["ended"]] == ["aborted"]
    desk.bus.see_arm()
    desk.turn(state(0, run=2))
    assert desk.fault is None


@pytest.mark.parametrize("arm_clock", ["realtime", "stepped"])
def test_with_other_clocks_a_lost_token_is_no_fault(desks: Callable[..., Desk], arm_clock: m.Clock):
    """In real time only missing states count; in stepped time no state is due."""
    desk = desks(arm_clock)
    desk.turn(state(0))
    desk.bus.see_arm(alive=False)
    desk.turn()
    assert desk.fault is None


@pytest.mark.parametrize(("arm_clock", "state_after", "last"), [("realtime", PATIENCE_S, 0), ("paced", 0.5, 1)])
def test_a_controller_that_ends_stops_the_motion(
    desks: Callable[..., Desk], arm_clock: m.Clock, state_after: float, last: int, monkeypatch: pytest.MonkeyPatch
):
    """In real time it gives up after a silence; in paced time it waits."""
    monkeypatch.setattr("services.controller.loop.FAREWELL_S", 2 * PATIENCE_S)
    desk = desks(arm_clock, clock=time.perf_counter_ns)
    desk.turn(state(0))
    desk.ask(topics.EXECUTE, staying(5, 1))
    late = threading.Timer(state_after, desk.bus.send, [encode(state(1))])
    late.start()
    desk.loop.close()
    late.cancel()
    late.join()
    assert desk.answered[-1] == last


def test_in_paced_time_a_controller_that_ends_does_not_wait_for_an_absent_arm(
    desks: Callable[..., Desk], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("services.controller.loop.FAREWELL_S", 2 * PATIENCE_S)
    desk = desks("paced", clock=time.perf_counter_ns)
    desk.turn(state(0))
    desk.ask(topics.EXECUTE, staying(5, 1))
    desk.bus.see_arm(alive=False)
    began = time.monotonic()
    desk.loop.close()
    assert time.monotonic() - began < PATIENCE_S


def test_a_contact_on_the_bus_is_in_the_result_of_the_motion(desk: Desk):
    """A malformed contact is ignored."""
    desk.turn(state(0))
    desk.turn(state(1))
    desk.ask(topics.EXECUTE, staying(start=3, epoch=1))
    touch = m.Contact(time=0.004, bodies=["racket", "floor"], impulse=0.1, ball_velocity=None, ended=False)
    for tick in (2, 3, 4):
        desk.turn(state(tick))
    for body in (NOISE, encode(touch)):
        desk.bus.listeners["contact"](body)
    for tick in (5, 6):
        desk.turn(state(tick))
    result = desk.ask(topics.RESULT, m.ResultRequest(goal_id="goal"))
    assert result.first_contact == m.FirstContact(body="racket", other="floor", time=0.004)


@pytest.mark.parametrize("time", [1.7e308, -1.7e308])
def test_a_contact_at_an_absurd_time_ends_nothing(desk: Desk, time: float):
    """Times the rate, this number overflows to infinity."""
    desk.turn(state(0))
    touch = m.Contact(time=time, bodies=["racket", "floor"], impulse=0.1, ball_velocity=None, ended=False)
    desk.bus.listeners["contact"](encode(touch))
    desk.turn(state(1))
    assert desk.answered[-1] == 1
