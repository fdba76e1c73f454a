"""`method: "dmp"` over the wire: goals are planned, played, reported and refused."""

import numpy as np
import pytest
from harness import Stack

from deploy.demonstrations.make_forehand import HIT, HIT_VELOCITIES
from protocol import messages as m
from protocol import topics
from robot.description import load_robot

ROBOT = load_robot()
STRIKE = {"primitive": "forehand", "positions": list(HIT), "velocities": list(HIT_VELOCITIES), "method": "dmp"}
FAR = {**STRIKE, "positions": [2.1, *HIT[1:]], "velocities": [12.0, *HIT_VELOCITIES[1:]], "duration": 0.4}


def test_it_is_played_and_published(stack: Stack):
    """The arm follows the DMP, hits where it ends and comes to rest; the plan is published and not certified."""
    stack.listen(topics.PLAN)
    reply = stack.goal(**STRIKE)
    result = stack.finish(reply)
    assert result.outcome == "succeeded"
    assert result.hit is not None
    assert max(map(abs, result.hit.position_error)) < 1e-4
    assert not reply.report.certified
    assert max(reply.report.final_error.positions) < 1e-3
    assert stack.next(topics.PLAN).goal_id == reply.goal_id


def test_it_imitates_less_closely_than_the_quadratic_program(stack: Stack):
    """The reports for the same goal from the same start show a larger imitation error on every joint."""
    fields = {**STRIKE, "duration": 0.8, "plan_only": True}
    dmp, qp = stack.goal(**fields), stack.goal(**{**fields, "method": "qp"})
    assert np.all(np.array(dmp.report.imitation_rms) > qp.report.imitation_rms)
    assert qp.report.certified
    assert (dmp.duration, dmp.start_time) == (qp.duration, qp.start_time)


def test_a_plan_outside_the_limits_is_refused(stack: Stack):
    """The refusal has the joint, the quantity, the value and the bound; nothing moves."""
    before = stack.state().positions
    refusal = stack.refused_goal(**FAR)
    assert refusal.code == "limit"
    assert set(refusal.detail) == {"joint", "quantity", "value", "bound"}
    stack.step(50)
    assert np.allclose(stack.state().positions, before, atol=1e-6)
    assert stack.status().goal_id is None


def test_plan_only_reports_the_violations(stack: Stack):
    """The margins are negative by as much as the extremes exceed the limits."""
    report = stack.goal(**FAR, plan_only=True).report
    assert not report.certified
    low, high = np.array(report.extremes.positions).T
    limits = ROBOT.limits.positions
    margin = report.margin
    assert np.allclose(np.array(margin.positions), np.minimum(low - limits[:, 0], limits[:, 1] - high), atol=1e-9)
    assert np.array([margin.positions, margin.velocities, margin.accelerations, margin.jerks]).min() < -0.01


@pytest.mark.parametrize(
    ("field", "more"),
    [
        ("waypoints", {"waypoints": [m.Waypoint(time_from_start=0.5, positions=[0.1, *5 * [None]])]}),
        ("rest_fraction", {"rest_fraction": 0.1}),
        ("accelerations", {"accelerations": [0.0] * 6}),
        (
            "start.accelerations",
            {
                "start": m.Start(positions=[0.0] * 6, velocities=[0.0] * 6, accelerations=[0.0, *5 * [None]]),
                "plan_only": True,
            },
        ),
    ],
)
def test_what_a_dmp_cannot_do_is_refused(stack: Stack, field: str, more: dict):
    """The refusal names the unsupported field and the method "qp"."""
    refusal = stack.refused_goal(**STRIKE, **more)
    assert (refusal.code, refusal.detail["field"]) == ("invalid_goal", field)
    assert "'qp'" in str(refusal)


def test_it_takes_over_a_running_motion(stack: Stack):
    """A DMP that replaces a motion continues its position and velocity; its acceleration changes within one tick."""
    stack.goal(**{**STRIKE, "method": "qp"})
    stack.step(250)
    reply = stack.goal(**STRIKE)
    assert stack.finish(reply).outcome == "succeeded"
