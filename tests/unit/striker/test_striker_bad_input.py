"""Invalid or missing sights, replies and commands: each is reported, and no further goals are sent."""

import logging

import numpy as np
import pytest
from test_striker_core import LIBRARY, ORDER, ROBOT, FakeOutside, accepted, first_goal, fly

from protocol import messages as m
from protocol.errors import NoAnswer, Refusal
from services.striker.core import Striker
from services.striker.mind import Mind


def sight(time: float, *position: float, velocity: tuple[float, ...] | None = None) -> m.BallState:
    return m.BallState(time=time, position=list(position), velocity=list(velocity) if velocity else None)


def swinging(striker: Striker, outside: FakeOutside) -> m.Goal:
    """Accept the goal of a swing, and return it."""
    goal = first_goal(striker, outside)
    striker.answered(goal.goal_id or "", accepted(goal))
    return goal


def wait(striker: Striker, outside: FakeOutside, until: float) -> None:
    """Advance robot time to `until`, s, without sights."""
    outside.tick = round(1000 * until)
    striker.decide()


def test_without_a_ball_only_the_goal_to_go_home_is_sent(striker: Striker, outside: FakeOutside):
    striker.order(ORDER)
    for tick in range(20):
        wait(striker, outside, 0.1 * tick)
    assert len(outside.goals) == 1
    assert outside.goals[0].positions == ROBOT.home.tolist()
    assert not outside.said


def test_a_ball_lost_before_a_hit_is_found_is_missed(striker: Striker, outside: FakeOutside):
    first_goal(striker, outside)
    outside.goals.clear()
    striker.answered(outside.asked[-1], NoAnswer("planner", "volley/arm/goal"))
    wait(striker, outside, 0.5)
    assert outside.said[-1].phase == "missed"
    assert "not seen for" in outside.said[-1].reason
    assert not outside.goals


def test_a_ball_lost_during_the_swing_does_not_change_the_swing(striker: Striker, outside: FakeOutside):
    swinging(striker, outside)
    wait(striker, outside, 0.13)
    striker.answered(outside.asked[-1], accepted(outside.goals[-1]))
    asked = len(outside.goals)
    for time in np.arange(0.2, 0.4, 0.01):
        wait(striker, outside, float(time))
    assert len(outside.goals) == asked


def test_a_single_outlier_is_ignored(striker: Striker, outside: FakeOutside):
    goal = swinging(striker, outside)
    striker.see(sight(0.125, 0.0, 0.0, 9.0))
    striker.decide()
    correction = outside.goals[-1]
    assert correction.revises == goal.goal_id
    assert correction.positions == pytest.approx(goal.positions, abs=0.5), (
        "the correction is for the ball before the outlier"
    )
    assert not [said for said in outside.said if said.phase == "missed"]


def test_a_ball_that_continues_elsewhere_is_a_new_ball(striker: Striker, outside: FakeOutside):
    swinging(striker, outside)
    for index in range(6):
        time = 0.13 + 0.01 * index
        outside.tick = round(1000 * time)
        striker.see(sight(time, 6.0 - 0.06 * index, 1.0, 3.0))
        striker.decide()
    assert [said.reason for said in outside.said if said.phase == "missed"] == ["another ball was seen"]


@pytest.mark.parametrize(
    "ball",
    [
        sight(0.13, 1.0, 2.0),
        sight(0.13, float("nan"), 0.0, 1.0),
        sight(0.13, 0.0, 0.0, float("inf")),
        sight(-5.0, 1.0, 0.0, 1.0),
        sight(1e9, 1.0, 0.0, 1.0),
        sight(0.4, 1.0, 0.0, 1.0),
        sight(0.13, 1e300, 0.0, 1.0),
        sight(0.13, 1.0, 0.0, 1.0, velocity=(1e300, 0.0, 0.0)),
    ],
    ids=["two coordinates", "nan", "infinite", "past", "future", "soon", "far", "fast"],
)
def test_an_invalid_sight_is_ignored_and_the_swing_corrected(
    striker: Striker, outside: FakeOutside, ball: m.BallState, caplog: pytest.LogCaptureFixture
):
    goal = swinging(striker, outside)
    with caplog.at_level(logging.WARNING):
        striker.see(ball)
        striker.decide()
    assert "left out" in caplog.text
    assert not [said for said in outside.said if said.phase == "missed"]
    correction = outside.goals[-1]
    assert correction.revises == goal.goal_id
    striker.answered(correction.goal_id or "", accepted(correction))
    fly(striker, outside, 0.2, since=0.14)
    assert outside.goals[-1].revises == correction.goal_id


def test_a_sight_whose_velocity_is_nan_raises_no_error(striker: Striker, outside: FakeOutside):
    striker.see(sight(0.0, 1.0, 0.0, 1.0, velocity=(float("nan"), 0.0, 0.0)))
    striker.see(sight(0.01, 0.96, 0.0, 1.0, velocity=(-4.0, 0.0)))
    striker.decide()
    assert not outside.said


def test_the_first_of_two_balls_is_played(striker: Striker, outside: FakeOutside):
    striker.order(ORDER)
    striker.decide()
    striker.answered(outside.goals.pop().goal_id or "", accepted(m.Goal(primitive="")))
    fly(striker, outside, 0.16, beside=(0.0, 1.5, 0.3))
    hits = [goal for goal in outside.goals if goal.arrival_time is not None]
    assert len(hits) == 1
    assert [said.phase for said in outside.said] == ["seen"]


def test_a_ball_out_of_reach_is_refused_and_missed_once_past(striker: Striker, outside: FakeOutside):
    striker.order(ORDER)
    striker.decide()
    outside.goals.clear()
    for index in range(90):
        time = 0.01 * index
        outside.tick = round(1000 * time)
        height = 4.0 + 4.0 * time - 9.81 * time**2 / 2
        striker.see(sight(time, 4.0 - 6.0 * time, 0.0, height, velocity=(-6.0, 0.0, 4.0 - 9.81 * time)))
        striker.decide()
    phases = [said.phase for said in outside.said]
    assert not [goal for goal in outside.goals if goal.arrival_time is not None]
    assert phases[0] == "seen"
    assert phases[-1] == "missed"
    assert 1 <= phases.count("refused") <= 5
    assert outside.said[-1].reason


def test_a_planner_that_stops_answering_during_a_swing_is_reported_once(striker: Striker, outside: FakeOutside):
    goal = swinging(striker, outside)
    for _ in range(2):
        fly(striker, outside, 0.17, since=0.13)
        striker.answered(outside.asked[-1], NoAnswer("planner", "volley/arm/goal"))
    silent = [said for said in outside.said if said.phase == "refused"]
    assert len(silent) == 1
    assert "planner" in silent[0].reason
    assert silent[0].goal_id == goal.goal_id


def test_a_swing_superseded_by_another_client_is_missed(striker: Striker, outside: FakeOutside):
    swinging(striker, outside)
    fly(striker, outside, 0.17, since=0.13)
    striker.answered(outside.asked[-1], Refusal("superseded", "another motion replaced it", goal_id="x", cause="plan"))
    assert outside.said[-1].phase == "missed"
    assert "replaced" in outside.said[-1].reason


def test_a_new_run_discards_the_ball_and_sends_the_arm_home(striker: Striker, outside: FakeOutside):
    swinging(striker, outside)
    outside.run, outside.tick = 2, 0
    outside.goals.clear()
    striker.decide()
    assert [goal.positions for goal in outside.goals] == [ROBOT.home.tolist()]
    fly(striker, outside, 0.12)
    assert outside.said[-1].phase == "seen"


def test_after_an_internal_error_the_ball_is_missed_and_the_striker_continues(mind: Mind, outside: FakeOutside):
    mind.estimator.reset()
    striker = Striker(ROBOT, mind, outside, LIBRARY, logging.getLogger("striker"))
    swinging(striker, outside)
    striker.give_up("the striker met an error of its own")
    assert outside.said[-1].phase == "missed"
    striker.decide()
