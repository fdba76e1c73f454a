"""Sights, replies and commands that are wrong or stop coming: each is said, and nothing more is asked for."""

import logging

import numpy as np
import pytest
from test_striker_core import LIBRARY, ORDER, ROBOT, Recorded, accepted, begun, fly

from protocol import messages as m
from protocol.errors import NoAnswer, Refusal
from services.striker.core import Striker
from services.striker.mind import Mind


def sight(time: float, *position: float, velocity: tuple[float, ...] | None = None) -> m.BallState:
    return m.BallState(time=time, position=list(position), velocity=list(velocity) if velocity else None)


def swinging(striker: Striker, outside: Recorded) -> m.Goal:
    """Let a swing be accepted, and return its goal."""
    goal = begun(striker, outside)
    striker.answered(goal.goal_id or "", accepted(goal))
    return goal


def wait(striker: Striker, outside: Recorded, until: float) -> None:
    """Let the robot's time pass without a ball."""
    outside.tick = round(1000 * until)
    striker.decide()


def test_without_a_ball_nothing_is_asked_but_the_way_home(striker: Striker, outside: Recorded):
    striker.order(ORDER)
    for tick in range(20):
        wait(striker, outside, 0.1 * tick)
    assert len(outside.goals) == 1
    assert outside.goals[0].positions == ROBOT.home.tolist()
    assert not outside.said


def test_a_ball_that_stops_coming_before_a_hit_was_found_is_missed(striker: Striker, outside: Recorded):
    begun(striker, outside)
    outside.goals.clear()
    striker.answered(outside.asked[-1], NoAnswer("planner", "volley/arm/goal"))
    wait(striker, outside, 0.5)
    assert outside.said[-1].phase == "missed"
    assert "not seen for" in outside.said[-1].reason
    assert not outside.goals


def test_a_ball_that_stops_coming_in_mid_swing_leaves_the_swing_as_it_is(striker: Striker, outside: Recorded):
    swinging(striker, outside)
    wait(striker, outside, 0.13)
    striker.answered(outside.asked[-1], accepted(outside.goals[-1]))
    asked = len(outside.goals)
    for time in np.arange(0.2, 0.4, 0.01):
        wait(striker, outside, float(time))
    assert len(outside.goals) == asked


def test_a_single_jump_is_left_out(striker: Striker, outside: Recorded):
    goal = swinging(striker, outside)
    striker.see(sight(0.125, 0.0, 0.0, 9.0))
    striker.decide()
    correction = outside.goals[-1]
    assert correction.revises == goal.goal_id
    assert correction.positions == pytest.approx(goal.positions, abs=0.5), (
        "of the ball as it was, 20 ms earlier or later"
    )
    assert not [said for said in outside.said if said.phase == "missed"]


def test_a_ball_that_jumps_for_good_is_another_ball(striker: Striker, outside: Recorded):
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
def test_what_is_no_sight_is_left_out_and_the_swing_goes_on(
    striker: Striker, outside: Recorded, ball: m.BallState, caplog: pytest.LogCaptureFixture
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


def test_a_velocity_that_is_nan_does_not_spoil_the_ball(striker: Striker, outside: Recorded):
    striker.see(sight(0.0, 1.0, 0.0, 1.0, velocity=(float("nan"), 0.0, 0.0)))
    striker.see(sight(0.01, 0.96, 0.0, 1.0, velocity=(-4.0, 0.0)))
    striker.decide()
    assert not outside.said


def test_of_two_balls_the_first_is_played(striker: Striker, outside: Recorded):
    striker.order(ORDER)
    striker.decide()
    striker.answered(outside.goals.pop().goal_id or "", accepted(m.Goal(primitive="")))
    fly(striker, outside, 0.16, beside=(0.0, 1.5, 0.3))
    hits = [goal for goal in outside.goals if goal.arrival_time is not None]
    assert len(hits) == 1
    assert [said.phase for said in outside.said] == ["seen"]


def test_a_ball_out_of_reach_is_refused_once_and_is_over_when_it_went_by(striker: Striker, outside: Recorded):
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


def test_a_planner_that_dies_in_mid_swing_is_said_once_and_the_swing_goes_on(striker: Striker, outside: Recorded):
    goal = swinging(striker, outside)
    for _ in range(2):
        fly(striker, outside, 0.17, since=0.13)
        striker.answered(outside.asked[-1], NoAnswer("planner", "volley/arm/goal"))
    silent = [said for said in outside.said if said.phase == "refused"]
    assert len(silent) == 1
    assert "planner" in silent[0].reason
    assert silent[0].goal_id == goal.goal_id


def test_a_swing_that_another_client_replaced_is_given_up(striker: Striker, outside: Recorded):
    swinging(striker, outside)
    fly(striker, outside, 0.17, since=0.13)
    striker.answered(outside.asked[-1], Refusal("superseded", "another motion replaced it", goal_id="x", cause="plan"))
    assert outside.said[-1].phase == "missed"
    assert "replaced" in outside.said[-1].reason


def test_a_new_run_forgets_the_ball_and_goes_home(striker: Striker, outside: Recorded):
    swinging(striker, outside)
    outside.run, outside.tick = 2, 0
    outside.goals.clear()
    striker.decide()
    assert [goal.positions for goal in outside.goals] == [ROBOT.home.tolist()]
    fly(striker, outside, 0.12)
    assert outside.said[-1].phase == "seen"


def test_an_error_of_its_own_costs_one_ball(mind: Mind, outside: Recorded):
    mind.estimator.reset()
    striker = Striker(ROBOT, mind, outside, LIBRARY, logging.getLogger("striker"))
    swinging(striker, outside)
    striker.give_up("the striker met an error of its own")
    assert outside.said[-1].phase == "missed"
    striker.decide()
