"""Invalid or missing sights, replies and commands: each is reported, and no further goals are sent."""

import logging

import numpy as np
import pytest
from test_striker_core import LIBRARY, ORDER, ROBOT, FakeLink, accepted, first_goal, fly

from protocol import messages as m
from protocol.errors import NoAnswer, Refusal
from services.striker.core import Striker
from services.striker.hit_planner import HitPlanner


def sight(time: float, *position: float, velocity: tuple[float, ...] | None = None) -> m.BallState:
    return m.BallState(time=time, position=list(position), velocity=list(velocity) if velocity else None)


def swinging(striker: Striker, link: FakeLink) -> m.Goal:
    """Accept the goal of a swing, and return it."""
    goal = first_goal(striker, link)
    striker.handle_reply(goal.goal_id or "", accepted(goal))
    return goal


def wait(striker: Striker, link: FakeLink, until: float) -> None:
    """Advance robot time to `until`, s, without sights."""
    link.tick = round(1000 * until)
    striker.decide()


def test_without_a_ball_only_the_goal_to_go_home_is_sent(striker: Striker, link: FakeLink):
    striker.start(ORDER)
    for tick in range(20):
        wait(striker, link, 0.1 * tick)
    assert len(link.goals) == 1
    assert link.goals[0].positions == ROBOT.home.tolist()
    assert not link.published


def test_a_ball_lost_before_a_hit_is_found_is_missed(striker: Striker, link: FakeLink):
    first_goal(striker, link)
    link.goals.clear()
    striker.handle_reply(link.goal_ids[-1], NoAnswer("planner", "volley/arm/goal"))
    wait(striker, link, 0.5)
    assert link.published[-1].phase == "missed"
    assert "not seen for" in link.published[-1].reason
    assert not link.goals


def test_a_ball_lost_during_the_swing_does_not_change_the_swing(striker: Striker, link: FakeLink):
    swinging(striker, link)
    wait(striker, link, 0.13)
    striker.handle_reply(link.goal_ids[-1], accepted(link.goals[-1]))
    asked = len(link.goals)
    for time in np.arange(0.2, 0.4, 0.01):
        wait(striker, link, float(time))
    assert len(link.goals) == asked


def test_a_single_outlier_is_ignored(striker: Striker, link: FakeLink):
    goal = swinging(striker, link)
    striker.handle_ball(sight(0.125, 0.0, 0.0, 9.0))
    striker.decide()
    correction = link.goals[-1]
    assert correction.revises == goal.goal_id
    assert correction.positions == pytest.approx(goal.positions, abs=0.5), (
        "the correction is for the ball before the outlier"
    )
    assert not [strike for strike in link.published if strike.phase == "missed"]


def test_a_ball_that_continues_elsewhere_is_a_new_ball(striker: Striker, link: FakeLink):
    swinging(striker, link)
    for index in range(6):
        time = 0.13 + 0.01 * index
        link.tick = round(1000 * time)
        striker.handle_ball(sight(time, 6.0 - 0.06 * index, 1.0, 3.0))
        striker.decide()
    assert [strike.reason for strike in link.published if strike.phase == "missed"] == ["another ball was seen"]


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
    striker: Striker, link: FakeLink, ball: m.BallState, caplog: pytest.LogCaptureFixture
):
    goal = swinging(striker, link)
    with caplog.at_level(logging.WARNING):
        striker.handle_ball(ball)
        striker.decide()
    assert "left out" in caplog.text
    assert not [strike for strike in link.published if strike.phase == "missed"]
    correction = link.goals[-1]
    assert correction.revises == goal.goal_id
    striker.handle_reply(correction.goal_id or "", accepted(correction))
    fly(striker, link, 0.2, since=0.14)
    assert link.goals[-1].revises == correction.goal_id


def test_a_sight_whose_velocity_is_nan_raises_no_error(striker: Striker, link: FakeLink):
    striker.handle_ball(sight(0.0, 1.0, 0.0, 1.0, velocity=(float("nan"), 0.0, 0.0)))
    striker.handle_ball(sight(0.01, 0.96, 0.0, 1.0, velocity=(-4.0, 0.0)))
    striker.decide()
    assert not link.published


def test_the_first_of_two_balls_is_played(striker: Striker, link: FakeLink):
    striker.start(ORDER)
    striker.decide()
    striker.handle_reply(link.goals.pop().goal_id or "", accepted(m.Goal(primitive="")))
    fly(striker, link, 0.16, beside=(0.0, 1.5, 0.3))
    hits = [goal for goal in link.goals if goal.arrival_time is not None]
    assert len(hits) == 1
    assert [strike.phase for strike in link.published] == ["seen"]


def test_a_ball_out_of_reach_is_refused_and_missed_once_past(striker: Striker, link: FakeLink):
    striker.start(ORDER)
    striker.decide()
    link.goals.clear()
    for index in range(90):
        time = 0.01 * index
        link.tick = round(1000 * time)
        height = 4.0 + 4.0 * time - 9.81 * time**2 / 2
        striker.handle_ball(sight(time, 4.0 - 6.0 * time, 0.0, height, velocity=(-6.0, 0.0, 4.0 - 9.81 * time)))
        striker.decide()
    phases = [strike.phase for strike in link.published]
    assert not [goal for goal in link.goals if goal.arrival_time is not None]
    assert phases[0] == "seen"
    assert phases[-1] == "missed"
    assert 1 <= phases.count("refused") <= 5
    assert link.published[-1].reason


def test_a_planner_that_stops_answering_during_a_swing_is_reported_once(striker: Striker, link: FakeLink):
    goal = swinging(striker, link)
    for _ in range(2):
        fly(striker, link, 0.17, since=0.13)
        striker.handle_reply(link.goal_ids[-1], NoAnswer("planner", "volley/arm/goal"))
    silent = [strike for strike in link.published if strike.phase == "refused"]
    assert len(silent) == 1
    assert "planner" in silent[0].reason
    assert silent[0].goal_id == goal.goal_id


def test_a_swing_superseded_by_another_client_is_missed(striker: Striker, link: FakeLink):
    swinging(striker, link)
    fly(striker, link, 0.17, since=0.13)
    refusal = Refusal("superseded", "another motion replaced it", goal_id="x", cause="plan")
    striker.handle_reply(link.goal_ids[-1], refusal)
    assert link.published[-1].phase == "missed"
    assert "replaced" in link.published[-1].reason


def test_a_new_run_discards_the_ball_and_sends_the_arm_home(striker: Striker, link: FakeLink):
    swinging(striker, link)
    link.run, link.tick = 2, 0
    link.goals.clear()
    striker.decide()
    assert [goal.positions for goal in link.goals] == [ROBOT.home.tolist()]
    fly(striker, link, 0.12)
    assert link.published[-1].phase == "seen"


def test_after_an_internal_error_the_ball_is_missed_and_the_striker_continues(hit_planner: HitPlanner, link: FakeLink):
    hit_planner.estimator.reset()
    striker = Striker(ROBOT, hit_planner, link, LIBRARY, logging.getLogger("striker"))
    swinging(striker, link)
    striker.abandon_ball("the striker met an error of its own")
    assert link.published[-1].phase == "missed"
    striker.decide()
