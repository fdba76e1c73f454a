"""The outcome of each goal, as the controller records it."""

import numpy as np
import pytest

from protocol import messages as m
from protocol.errors import Refusal
from services.controller.ledger import KEPT, ActiveGoal, Ledger


def running(goal_id: str, start: int, hit: int = 100, end: int = 150) -> ActiveGoal:
    """Return an active goal that starts at `start`."""
    return ActiveGoal(m.Result(goal_id=goal_id, outcome="running"), "", False, start, hit, end)


def outcomes(ledger: Ledger) -> dict[str, str]:
    """Return what ended since the last call."""
    return {result.goal_id: result.outcome for result in ledger.take_ended()}


def hit() -> m.Hit:
    """Return any hit."""
    return m.Hit(time=0.1, position_error=[0.0], velocity_error=[0.0])


def test_a_goal_succeeds_at_its_end():
    """It does so at its last tick, not one earlier, and is reported once."""
    ledger = Ledger()
    ledger.open(running("a", 10))
    assert not ledger.close_due(149)
    assert ledger.result("a").outcome == "running"
    assert ledger.close_due(150)
    assert outcomes(ledger) == {"a": "succeeded"}
    assert outcomes(ledger) == {}
    assert ledger.result("a").outcome == "succeeded"


@pytest.mark.parametrize(("has_hit", "outcome"), [(False, "preempted"), (True, "succeeded")])
def test_a_successor_ends_a_goal_at_its_own_start(has_hit: bool, outcome: str):
    """The goal is preempted, or succeeds if it had already hit; the successor is named."""
    ledger = Ledger()
    first = running("a", 10)
    ledger.open(first)
    ledger.open(running("b", 60, 200, 250))
    assert not ledger.close_due(59)
    first.result.hit = hit() if has_hit else None
    assert ledger.close_due(60)
    assert outcomes(ledger) == {"a": outcome}
    assert "b" in ledger.result("a").reason
    assert [goal.result.goal_id for goal in ledger.active] == ["b"]


def test_a_goal_that_is_replaced_before_it_begins_ends_at_once():
    """It would otherwise be examined at every tick, and thousands could wait for the same start."""
    ledger = Ledger()
    for name, start in (("a", 0), ("b", 50), ("c", 40)):
        ledger.open(running(name, start))
    assert outcomes(ledger) == {"b": "preempted"}
    assert "c" in ledger.result("b").reason
    ledger.close_due(39)
    assert outcomes(ledger) == {}
    ledger.close_due(40)
    assert outcomes(ledger) == {"a": "preempted"}


def test_thousands_of_goals_for_the_same_start_leave_one():
    ledger = Ledger()
    for number in range(5000):
        ledger.open(running(str(number), 40))
    assert [goal.result.goal_id for goal in ledger.active] == ["4999"]


def test_a_cancel_ends_at_rest():
    """A goal loses its hit only if the stop begins before the hit."""
    for leaves, reached in ((99, False), (100, True)):
        ledger = Ledger()
        goal = running("a", 10)
        ledger.open(goal)
        ledger.close_later(leaves, 120, "canceled", "on request")
        assert (goal.hit is not None) == reached
        ledger.close_due(119)
        assert outcomes(ledger) == {}
        ledger.close_due(120)
        assert outcomes(ledger) == {"a": "canceled"}


def test_a_second_cancel_changes_nothing():
    """The first reason stays."""
    ledger = Ledger()
    ledger.open(running("a", 10))
    ledger.close_later(50, 80, "canceled", "first")
    ledger.close_later(60, 90, "canceled", "second")
    ledger.close_due(80)
    assert ledger.result("a").reason == "first"


def test_a_canceled_goal_stays_canceled_where_another_takes_over():
    """The new goal begins during the stop."""
    ledger = Ledger()
    ledger.open(running("a", 10))
    ledger.close_later(50, 80, "canceled", "on request")
    ledger.open(running("b", 60))
    ledger.close_due(60)
    assert outcomes(ledger) == {"a": "canceled"}


def test_the_current_goal_is_the_last_one_that_has_begun():
    ledger = Ledger()
    assert ledger.current(0) is None
    first, second = running("a", 10), running("b", 60)
    ledger.open(first)
    ledger.open(second)
    assert [ledger.current(tick) for tick in (9, 10, 59, 60)] == [None, first, first, second]


def test_the_goal_of_a_tick():
    """None at rest and during a stop, when another goal may begin."""
    ledger = Ledger()
    ledger.open(running("a", 10))
    end = ledger.active[0].end
    assert [ledger.played_at(tick) for tick in (9, 10, end - 1, end)] == [None, "a", "a", None]
    ledger.open(running("b", 60))
    assert [ledger.played_at(tick) for tick in (59, 60)] == ["a", "b"]
    ledger.close_later(50, 80, "canceled", "on request")
    assert [ledger.played_at(tick) for tick in (20, 60, 100)] == [None, None, None]


def test_the_last_thousand_results_are_kept():
    """Older ones are unknown, and the sentence names how many are kept."""
    ledger = Ledger()
    for k in range(KEPT + 1):
        ledger.open(running(str(k), k))
    assert ledger.knows("1")
    assert not ledger.knows("0")
    with pytest.raises(Refusal) as caught:
        ledger.result("0")
    assert caught.value.code == "unknown_goal"
    assert str(KEPT) in caught.value.message


def test_a_fault_ends_all_goals_at_once():
    """They have the fault's reason."""
    ledger = Ledger()
    ledger.open(running("a", 10))
    ledger.open(running("b", 60))
    ledger.close_all("aborted", "broken")
    assert outcomes(ledger) == {"a": "aborted", "b": "aborted"}
    assert ledger.active == []


def test_the_errors_at_the_hit():
    """Errors are measured minus reference, and truth minus reference if the truth is known."""
    reference = np.array([1.0, 2.0]), np.array([0.5, 0.0]), np.zeros(2)
    state = m.State(
        run=0, tick=7, time=0.007, positions=[1.1, 2.0], velocities=[0.5, 0.2], torques=[0.0, 0.0],
        saturated=[False, False], brake=False, applied_tick=6,
    )  # fmt: skip
    goal = running("a", 0, hit=state.tick)
    goal.follow(state, reference, 0.1, 5)
    result = goal.result
    assert result.hit is not None
    assert result.hit.time == state.time
    assert result.peak_tracking_error == 0.1
    assert result.stamps.first_command == 5
    assert result.hit.position_error == pytest.approx([0.1, 0.0])
    assert result.hit.velocity_error == pytest.approx([0.0, 0.2])
    assert result.hit.truth_error is None
    state.truth = m.Point(positions=[1.0, 2.5], velocities=[0.0, 0.0])
    result.hit = None
    goal.follow(state, reference, 0.05, 6)
    assert result.peak_tracking_error == 0.1
    assert result.stamps.first_command == 5
    assert result.hit is not None
    assert result.hit.truth_error == m.Point(positions=[0.0, 0.5], velocities=[-0.5, 0.0])


@pytest.mark.parametrize("goal_id", ["", "x" * 10_000, "a\nb"])
def test_an_invalid_goal_id_is_refused(goal_id: str):
    """The request is malformed, and refused in one short sentence."""
    with pytest.raises(Refusal) as caught:
        Ledger().result(goal_id)
    assert (caught.value.code, caught.value.detail) == ("bad_message", {"field": "goal_id"})
    assert len(caught.value.message) < 150
    assert caught.value.message.isprintable()
