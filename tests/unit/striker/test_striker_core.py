"""The striker without a bus: its goals and reports for a ball that flies as modelled."""

import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from protocol import messages as m
from protocol.errors import NoAnswer, Refusal
from robot.description import load_robot
from robot.striking.choice import Choice
from robot.striking.conversions import ball_of
from robot.striking.flight import Air, travel
from robot.striking.launcher import Launcher
from services.striker.core import Striker
from services.striker.hit_planner import HitPlanner
from services.striker.link import AcceptedGoal

ROBOT = load_robot()
ORDER = m.StrikeRequest(target=(4.5, 0.0, 0.0))
LIBRARY = [("forehand", 1.0)]


class FakeLink:
    """Records the striker's goals and reports; the arm's commands are at home."""

    def __init__(self) -> None:
        self.goals: list[m.Goal] = []
        self.published: list[m.Strike] = []
        self.goal_ids: list[str] = []
        self.run, self.tick = 1, 0

    def send_goal(self, goal: m.Goal) -> None:
        self.goals.append(goal)
        self.goal_ids.append(goal.goal_id or "")

    def publish(self, strike: m.Strike) -> None:
        self.published.append(strike)

    def newest_command(self) -> m.Command:
        home, rest = ROBOT.home.tolist(), [0.0] * 6
        return m.Command(
            run=self.run, tick=self.tick, source="", accelerations=rest, positions=home, velocities=rest, goal_id=None
        )


def accepted(goal: m.Goal) -> AcceptedGoal:
    """Return the planner's acceptance of a goal."""
    return AcceptedGoal(goal.goal_id or "", 0.1, 0.9)


def fly(
    striker: Striker,
    link: FakeLink,
    until: float,
    since: float = 0.0,
    beside: tuple[float, float, float] | None = None,
) -> None:
    """Report a volley's sights at 100 Hz, and with `beside` a second ball at that offset, m."""
    launch = Launcher(ROBOT, 4, "volley").next()
    ball = ball_of(ROBOT)
    air = Air(ball.drag)
    start, speed = np.array([launch.position]), np.array([launch.velocity])
    for index in range(round(since * 100), round(until * 100)):
        time = 0.01 * index
        place, velocity = travel(ball, air, start, speed, np.array([time]))
        link.tick = round(1000 * time)
        striker.handle_ball(m.BallState(time=time, position=place[0].tolist(), velocity=velocity[0].tolist()))
        if beside is not None:
            striker.handle_ball(m.BallState(time=time + 0.003, position=(place[0] + beside).tolist()))
        striker.decide()


def first_goal(striker: Striker, link: FakeLink) -> m.Goal:
    """Order strikes, accept the goal to go home, report a ball, and return the goal for it."""
    striker.start(ORDER)
    striker.decide()
    striker.handle_reply(link.goals.pop().goal_id or "", accepted(m.Goal(primitive="")))
    fly(striker, link, 0.12)
    return link.goals[0]


def test_an_approaching_ball_causes_a_goal(striker: Striker, link: FakeLink):
    goal = first_goal(striker, link)
    assert goal.revises is None
    assert goal.arrival_time is not None
    assert goal.arrival_time > 0.2
    assert [strike.phase for strike in link.published] == ["seen"]
    striker.handle_reply(goal.goal_id or "", accepted(goal))
    assert link.published[-1].phase == "planned"
    assert link.published[-1].racket is not None


def test_new_sights_correct_the_accepted_goal(striker: Striker, link: FakeLink):
    goal = first_goal(striker, link)
    striker.handle_reply(goal.goal_id or "", accepted(goal))
    fly(striker, link, 0.2)
    assert link.goals[-1].revises == goal.goal_id


def test_after_a_refused_correction_the_next_one_is_sent(
    striker: Striker, link: FakeLink, hit_planner: HitPlanner, monkeypatch: pytest.MonkeyPatch
):
    goal = first_goal(striker, link)
    striker.handle_reply(goal.goal_id or "", accepted(goal))

    def beside(hit: Choice) -> Choice:
        return replace(hit, positions=hit.positions + 0.01)

    monkeypatch.setattr(hit_planner, "correct", lambda begin, order, last: iter([last, beside(last)]))
    fly(striker, link, 0.2)
    refused = link.goals[-1]
    assert refused.revises == goal.goal_id
    striker.handle_reply(refused.goal_id or "", Refusal("late", "too fast", goal_id=""))
    assert link.goals[-1].revises == goal.goal_id
    assert refused.positions is not None
    assert link.goals[-1].positions == [position + 0.01 for position in refused.positions]
    count = len(link.goals)
    striker.handle_reply(link.goals[-1].goal_id or "", Refusal("late", "too fast", goal_id=""))
    assert len(link.goals) == count


def test_without_an_order_no_goals_are_sent(striker: Striker, link: FakeLink):
    fly(striker, link, 0.3)
    assert not link.goals
    assert not link.published


def test_an_absent_planner_is_reported(striker: Striker, link: FakeLink):
    goal = first_goal(striker, link)
    striker.handle_reply(goal.goal_id or "", NoAnswer("planner", "volley/arm/goal"))
    assert link.published[-1].phase == "refused"
    assert "planner is not running" in link.published[-1].reason


def test_a_target_behind_the_arm_is_refused_with_a_reason(striker: Striker, link: FakeLink):
    striker.start(m.StrikeRequest(target=(-90.0, 0.0, 0.0)))
    striker.decide()
    striker.handle_reply(link.goals.pop().goal_id or "", accepted(m.Goal(primitive="")))
    fly(striker, link, 0.12)
    assert not link.goals
    assert link.published[-1].phase == "refused"
    assert link.published[-1].reason


def test_a_ball_on_its_tee_is_ignored(striker: Striker, link: FakeLink):
    striker.start(ORDER)
    for index in range(40):
        striker.handle_ball(m.BallState(time=0.01 * index, position=[0.24, -0.91, 1.14], velocity=[0.0, 0.0, 0.0]))
        striker.decide()
    assert not link.published


@pytest.mark.parametrize(
    ("fields", "field"),
    [
        ({"target": (1e9, 0.0, 0.0)}, "target"),
        ({"flight_time": 0.0}, "flight_time"),
        ({"revise_hz": -1.0}, "revise_hz"),
        ({"until_s": 7.0}, "until_s"),
        ({"primitives": []}, "primitives"),
        ({"count": 0}, "count"),
    ],
)
def test_an_order_out_of_range_is_refused_with_its_field(striker: Striker, fields: dict[str, Any], field: str):
    with pytest.raises(Refusal) as refused:
        given: dict[str, Any] = {"target": (4.5, 0.0, 0.0), **fields}
        striker.start(m.StrikeRequest(**given))
    assert refused.value.detail["field"] == field


def test_an_unreadable_learning_file_is_refused_with_a_remedy(tmp_path: Path):
    (tmp_path / "arm.json").write_text("{")
    with pytest.raises(ValueError, match="delete it to learn again"):
        HitPlanner(ROBOT, tmp_path / "arm.json", logging.getLogger("striker"))
