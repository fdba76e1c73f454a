"""The states of the arm that are answered, and those that begin a run."""

import pytest

from protocol import messages as m
from protocol.errors import Refusal
from services.controller.states import States
from tests.unit.controller.stand_ins import CONFIG, state


@pytest.fixture
def states() -> States:
    """The newest state is tick 5 of run 1."""
    states = States(CONFIG.joint_count, CONFIG.silence_ticks)
    states.newest = state(5)
    return states


@pytest.mark.parametrize(
    "bad",
    [
        state(5),
        state(4),
        state(-1, run=2),
        state(6, positions=[0.0]),
        state(6, velocities=[0.0] * (CONFIG.joint_count + 1)),
        state(6, truth=m.Point(positions=[], velocities=[])),
        state(6, truth=m.Point(positions=[0.0] * CONFIG.joint_count, velocities=[0.0])),
    ],
    ids=["doubled", "old", "before the first", "short", "long", "empty truth", "short truth"],
)
def test_an_old_or_malformed_state_is_not_answered(states: States, bad: m.State):
    assert not states.admits(bad)


def test_a_late_state_of_an_earlier_run_is_not_answered(states: States):
    """It would begin a run, which ends all goals and a fault. With the clock stepped a run's number may be repeated."""
    states.take(state(0, run=2))
    assert not states.admits(state(6))
    assert states.admits(state(1, run=2))
    assert states.admits(state(0, run=3))
    states.stepped = True
    assert states.admits(state(6))


@pytest.mark.parametrize(
    ("good", "opens"), [(state(6), False), (state(900), False), (state(0, run=2), True), (state(7, run=2), True)]
)
def test_a_newer_state_is_answered(states: States, good: m.State, opens: bool):
    """The next state of the run, also after lost ones, or a state of another run."""
    assert states.admits(good)
    assert states.opens_run(good) is opens


def test_the_first_state_opens_a_run():
    states = States(CONFIG.joint_count, CONFIG.silence_ticks)
    assert states.admits(state(700))
    assert states.opens_run(state(700))


@pytest.mark.parametrize("stepped", [True, False])
def test_only_in_stepped_time_a_run_begins_again_under_its_number(states: States, stepped: bool):
    """Elsewhere a tick 0 of the same run is an old message."""
    states.stepped = stepped
    assert states.admits(state(0)) is stepped
    assert states.opens_run(state(0))


def test_ticks_up_to_the_newest_have_been_received(states: States):
    assert [states.has_seen(1, tick) for tick in (4, 5, 6)] == [True, True, False]
    assert not states.has_seen(2, 0)


def test_before_the_first_state_there_is_none_to_ask_for(states: States):
    assert states.require() == state(5)
    with pytest.raises(Refusal) as caught:
        States(CONFIG.joint_count, CONFIG.silence_ticks).require()
    assert (caught.value.code, caught.value.detail) == ("unavailable", {"service": "sim"})
