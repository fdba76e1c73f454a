"""The bounds of the demo's strikes, and its report."""

from types import SimpleNamespace
from unittest.mock import Mock

import msgspec
import pytest

from protocol import messages as m
from tools.demo.play import Player, StrikeOutcome
from tools.demo.report import closest_limit, table
from tools.demo.strikes import STRIKES, Strike

JOINTS = ("shoulder", "elbow")
STRIKE = Strike("test", STRIKES[0].fields, position_bound=1e-2, velocity_bound=1e-1)


def report(**changes: object) -> m.Report:
    """Return a report of two joints in which the elbow's velocity uses most of its limit."""
    zeros: list[m.Range] = [(0.0, 0.0)] * 2
    made = m.Report(
        imitation_rms=[3.0, 4.0],
        final_error=m.FinalError(positions=[0.0, 0.0], velocities=[0.0, 0.0]),
        extremes=m.Extremes(
            positions=[(-1.0, 0.5), (0.0, 0.1)], velocities=[(-2.0, 2.0), (-9.0, 1.0)], accelerations=zeros, jerks=zeros
        ),
        margin=m.Margin(positions=[1.0, 1.0], velocities=[8.0, 1.0], accelerations=[None, None], jerks=[0.0, 0.0]),
        active=[],
        certified=True,
        solve_ms=1.0,
        rounds=0,
        rows=0,
    )
    return msgspec.structs.replace(made, **changes)


def outcome(
    result: str = "succeeded", error: float = 1e-3, ball_speed: float = 5.0, **changes: object
) -> StrikeOutcome:
    """Return an outcome in which every bound holds, except for the given changes."""
    errors = m.Point(positions=[error, 0.0], velocities=[0.0, -error])
    hit = m.Hit(time=1.0, position_error=[0.0, 0.0], velocity_error=[0.0, 0.0], truth_error=errors)
    reply = m.GoalReply(goal_id="g", start_time=0.0, duration=1.0, total_duration=1.1, report=report(**changes))
    played = m.Result(goal_id="g", outcome=result, reason="", hit=hit)  # type: ignore[arg-type]
    return StrikeOutcome(STRIKE, reply, played, ball_speed, robot_s=1.8, wall_s=2.0)


def test_an_outcome_within_its_bounds_has_no_failures() -> None:
    assert outcome().failures() == []


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"result": "aborted"}, "aborted"),
        ({"error": 0.02}, "0.02 rad off"),
        ({"ball_speed": 0.0}, "missed the ball"),
        ({"certified": False}, "certificate"),
    ],
)
def test_a_failure_is_reported(changes: dict, says: str) -> None:
    (sentence,) = outcome(**changes).failures()
    assert says in sentence


def test_a_goal_that_ended_before_its_hit_is_reported() -> None:
    ended = outcome("canceled")
    ended.result.hit = None
    assert "canceled before the hit" in ended.failures()[0]


def test_a_contact_before_the_strike_is_no_touch(monkeypatch: pytest.MonkeyPatch) -> None:
    """For example of the ball that the strike before has hit."""
    played = outcome()
    late = m.Contact(time=1.0, bodies=["ball", "racket"], impulse=0.1, ball_velocity=[5.0, 0.0, 0.0])
    motion = SimpleNamespace(reply=played.reply, start_time=0.0, wait=lambda: played.result)
    arm = SimpleNamespace(
        stream=lambda *_: SimpleNamespace(take=Mock(side_effect=[late, TimeoutError, TimeoutError])),
        reset_sim=lambda **_: None,
        goal=lambda *_, **__: motion,
        state=lambda: SimpleNamespace(time=1.8),
    )
    monkeypatch.setattr("time.sleep", lambda _: None)
    assert Player(arm).play(STRIKE, 1, lambda _: None).ball_speed == 0.0  # type: ignore[arg-type]


def test_the_closest_limit_is_the_one_used_most() -> None:
    assert closest_limit(report(), JOINTS) == "elbow velocity 90%"


def test_an_active_limit_other_than_jerk_is_the_closest() -> None:
    active = [
        m.ActiveLimit(joint="elbow", quantity="jerk", time_from_start=0.1),
        m.ActiveLimit(joint="shoulder", quantity="position", time_from_start=0.2),
    ]
    assert closest_limit(report(active=active), JOINTS) == "shoulder position: reached"


def test_the_table_has_a_row_for_each_outcome() -> None:
    shown = table([outcome(), outcome("aborted")], JOINTS)
    assert shown.row_count == 2
