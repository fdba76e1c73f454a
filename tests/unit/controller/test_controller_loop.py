"""The controller's loop: which states it answers, and when their absence is a fault."""

import threading

import pytest

from protocol import messages as m
from protocol import topics
from protocol.codec import encode
from services.controller.handshake import WrongRobot
from tests.unit.controller.running_loop import RunningLoop
from tests.unit.controller.stand_ins import CONFIG, NOISE, description, state, staying


def test_a_state_followed_by_malformed_ones_is_answered(running: RunningLoop):
    """The newest good state is answered, and what was refused is counted, once each."""
    running.turn(state(5))
    running.turn(state(6), state(7), NOISE, state(3), b"")
    assert running.answered == [5, 7]
    assert running.ask(topics.STATUS_QUERY, m.Empty()).cycle.refused == 3


@pytest.mark.parametrize(
    "bad",
    [state(5), state(3), state(6, positions=[0.0]), state(6, truth=m.Point(positions=[], velocities=[])), NOISE],
    ids=["doubled", "old", "short", "truth", "noise"],
)
def test_a_state_that_is_not_answered_is_counted_once(running: RunningLoop, bad: m.State | bytes):
    running.turn(state(5))
    running.turn(bad)
    assert running.answered == [5]
    assert running.ask(topics.STATUS_QUERY, m.Empty()).cycle.refused == 1


def test_malformed_states_do_not_end_the_silence(running: RunningLoop, caplog: pytest.LogCaptureFixture):
    """Every wait without a valid state counts as silent, and the twentieth is a fault."""
    running.turn(state(5))
    for wait in range(1, CONFIG.silence_ticks + 1):
        assert running.fault is None
        running.wait(NOISE, NOISE)
        assert (running.fault is not None) == (wait == CONFIG.silence_ticks)
    assert running.fault == "no state for 20 ticks"
    assert "the arm fell silent" in caplog.text


def test_a_state_ends_the_silence(running: RunningLoop):
    """The count starts again at 0."""
    running.turn(state(5))
    for tick in (6, 7):
        for _ in range(CONFIG.silence_ticks - 1):
            running.wait()
        running.turn(state(tick))
    assert running.fault is None


def test_within_a_wait_nothing_is_counted(running: RunningLoop):
    """If noise ends a wait early, the loop waits for the rest of it."""
    running.turn(state(5))
    for _ in range(2 * CONFIG.silence_ticks):
        running.turn(NOISE)
        running.turn()
    assert running.fault is None


def test_a_refusal_is_logged_with_its_code(running: RunningLoop, caplog: pytest.LogCaptureFixture):
    running.turn(NOISE)
    assert [each.__dict__["code"] for each in caplog.records] == ["bad_message"]


def test_the_state_that_the_arm_was_asked_for_is_answered(running: RunningLoop):
    """It is not answered if the stream has brought it, or a newer one, meanwhile."""
    answer = running.bus.asked[-1][1]
    assert running.bus.asked[-1][0] == "state"
    answer(encode(state(0)))
    running.turn()
    assert running.answered == [0]
    running.turn(state(1))
    answer(encode(state(0)))
    running.turn()
    answer(encode(state(2)))
    running.turn()
    assert running.answered == [0, 1, 2]


def test_another_arm_ends_the_loop(running: RunningLoop):
    running.bus.see_arm()
    running.turn()
    running.bus.asked[-1][1](description("realtime", joint_names=["elbow"]))
    with pytest.raises(WrongRobot):
        running.loop.run(threading.Event())


def test_a_contact_on_the_bus_is_in_the_result_of_the_motion(running: RunningLoop):
    """A malformed contact is ignored."""
    running.turn(state(0))
    running.turn(state(1))
    running.ask(topics.EXECUTE, staying(start=3, epoch=1))
    touch = m.Contact(time=0.004, bodies=["racket", "floor"], impulse=0.1, ball_velocity=None, ended=False)
    for tick in (2, 3, 4):
        running.turn(state(tick))
    for body in (NOISE, encode(touch)):
        running.bus.listeners["contact"](body)
    for tick in (5, 6):
        running.turn(state(tick))
    result = running.ask(topics.RESULT, m.ResultRequest(goal_id="goal"))
    assert result.first_contact == m.FirstContact(body="racket", other="floor", time=0.004)


@pytest.mark.parametrize("time", [1.7e308, -1.7e308])
def test_a_contact_at_an_absurd_time_ends_nothing(running: RunningLoop, time: float):
    """Times the rate, this number overflows to infinity."""
    running.turn(state(0))
    touch = m.Contact(time=time, bodies=["racket", "floor"], impulse=0.1, ball_velocity=None, ended=False)
    running.bus.listeners["contact"](encode(touch))
    running.turn(state(1))
    assert running.answered[-1] == 1
