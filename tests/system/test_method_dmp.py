"""`method: "dmp"` over the wire: planned, played, reported and refused."""

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


def test_it_is_played_and_recorded_like_any_other(stack: Stack):
    """The arm follows, hits where the DMP says, comes to rest; the plan is published."""
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
    """Through the same reports, for the same goal from the same start."""
    fields = {**STRIKE, "duration": 0.8, "plan_only": True}
    dmp, qp = stack.goal(**fields), stack.goal(**{**fields, "method": "qp"})
    assert np.all(np.array(dmp.report.imitation_rms) > qp.report.imitation_rms)
    assert qp.report.certified
    assert (dmp.duration, dmp.start_time) == (qp.duration, qp.start_time)


def test_one_that_leaves_the_limits_is_refused_and_moves_nothing(stack: Stack):
    """With the joint, the quantity, the value and the bound."""
    before = stack.state().positions
    refusal = stack.refused_goal(**FAR)
    assert refusal.code == "limit"
    assert set(refusal.detail) == {"joint", "quantity", "value", "bound"}
    stack.step(50)
    assert np.allclose(stack.state().positions, before, atol=1e-6)
    assert stack.status().goal_id is None


def test_plan_only_reports_the_violations(stack: Stack):
    """Margins are negative by what the extremes pass the limits."""
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
    """Naming the field and the other method."""
    refusal = stack.refused_goal(**STRIKE, **more)
    assert (refusal.code, refusal.detail["field"]) == ("invalid_goal", field)
    assert "'qp'" in str(refusal)


def test_it_takes_over_a_running_motion(stack: Stack):
    """Spliced in at the reference's position and velocity; its acceleration goes over to the DMP's in one tick."""
    stack.goal(**{**STRIKE, "method": "qp"})
    stack.step(250)
    reply = stack.goal(**STRIKE)
    assert stack.finish(reply).outcome == "succeeded"
