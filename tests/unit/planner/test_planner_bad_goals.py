"""Goals that are refused: which code, field, joint and value the refusal names."""

from dataclasses import replace

import pytest

from motion.errors import CannotStop, Infeasible, InvalidMotion, LimitExceeded, MotionError, PlanExceeds, SolverFailed
from motion.primitive import Primitive
from protocol import messages as m
from protocol.errors import Refusal
from robot.torque_check import TorqueExceeded
from services.planner.goals import ends, motion_request
from services.planner.refusals import Joints, joints_of, refusal_of
from tests.unit.planner.goal_requests import FREE, HOME, JOINTS, ORIGIN, ROBOT, refused

SHORT = m.Waypoint(time_from_start=0.4, velocities=[1.0])


@pytest.mark.parametrize("time", [2.0, 1.0, -1e308, 2.0004])
def test_an_arrival_that_has_passed_is_late(primitive: Primitive, time: float):
    """It is compared with the time at which the motion can begin."""
    refusal = refused(primitive, arrival_time=time, goal_id="g")
    assert (refusal.code, refusal.detail["goal_id"]) == ("late", "g")
    assert "2.000 s" in refusal.message


@pytest.mark.parametrize(
    ("field", "fields"),
    [
        ("arrival_time", {"arrival_time": 62.1}),
        ("arrival_time", {"arrival_time": 1e308}),
        ("arrival_time", {"arrival_time": 3.0, "duration": 1.0}),
        ("duration", {"duration": 0.0}),
        ("duration", {"duration": 60.001}),
        ("revises", {"revises": ""}),
        ("start", {"revises": "g0", "start": m.Start(positions=HOME), "plan_only": True}),
        ("revises", {"revises": "g0", "method": "gaussian"}),
        ("alternatives", {"alternatives": [m.Alternative(duration=1.0)] * 257}),
        ("alternatives", {"alternatives": [m.Alternative(duration=1.0)], "method": "dmp"}),
        ("alternatives[1].duration", {"alternatives": [m.Alternative(), m.Alternative(duration=61.0)]}),
        ("alternatives[0].arrival_time", {"alternatives": [m.Alternative(duration=1.0, arrival_time=3.0)]}),
        (
            "alternatives[0].accelerations",
            {"rest_fraction": 0.1, "alternatives": [m.Alternative(accelerations=[1.0, *FREE])]},
        ),
        ("fastest", {"fastest": True, "duration": 1.0}),
        ("fastest", {"fastest": True, "arrival_time": 3.0}),
        ("fastest", {"fastest": True, "waypoints": [m.Waypoint(time_from_start=0.2)]}),
        ("fastest", {"fastest": True, "alternatives": [m.Alternative()]}),
        ("follow_through", {"follow_through": 0.6}),
        ("follow_through", {"follow_through": -0.1}),
        ("follow_through", {"follow_through": 0.1, "tail": "coast", "plan_only": True}),
        ("accelerations", {"follow_through": 0.1, "accelerations": [1.0, *FREE]}),
        ("place_time", {"place_time": 0.0}),
        ("place_time", {"place_time": 0.5, "method": "gaussian"}),
        ("start", {"start": m.Start(positions=HOME)}),
        ("tail", {"tail": "coast"}),
        ("client_id", {"lease": True}),
        ("goal_id", {"goal_id": ""}),
        ("goal_id", {"goal_id": "x" * 129}),
        ("goal_id", {"goal_id": "a\nb"}),
        ("revises", {"revises": "a\x1b[2Jb"}),
        ("client_id", {"client_id": "x" * 129}),
        ("client_id", {"client_id": "a\tb"}),
        ("client_id", {"client_id": "a/b", "lease": True}),
        ("rest_fraction", {"rest_fraction": 1.0}),
        ("accelerations", {"rest_fraction": 0.5, "accelerations": [1.0, *FREE]}),
        ("limits.velocities", {"limits": m.GoalLimits(velocities=[0.0, *FREE])}),
        ("limits.positions", {"limits": m.GoalLimits(positions=[(0.5, 0.5), *FREE])}),
        ("waypoints[0].time_from_start", {"waypoints": [m.Waypoint(time_from_start=0.0)]}),
        ("waypoints[0].time_from_start", {"waypoints": [m.Waypoint(time_from_start=0.2)] * 2}),
    ],
)
def test_invalid_goals_are_refused_with_their_field(primitive: Primitive, field: str, fields: dict[str, object]):
    refusal = refused(primitive, **fields)
    assert (refusal.code, refusal.detail["field"]) == ("invalid_goal", field)
    assert field.partition("[")[0].partition(".")[0] in refusal.message


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        (
            m.GoalLimits(jerks=[None, -2.0, *FREE[1:]]),
            "limits.jerks of joint_2 is -2 rad/s³; it must be at least 1e-06 rad/s³, or null",
        ),
        (m.GoalLimits(positions=[None, (1.0, 0.5), *FREE[1:]]), "limits.positions of joint_2 are 1 to 0.5 rad; send"),
        (m.GoalLimits(positions=[(3.0, 4.0), *FREE]), "joint_1 are 3 to 4 rad; the robot's own are -2.2 to 2.2 rad"),
    ],
)
def test_impossible_limits_are_refused_with_joint_and_value(primitive: Primitive, limits: m.GoalLimits, said: str):
    assert said in refused(primitive, limits=limits).message


@pytest.mark.parametrize(
    ("field", "fields"),
    [
        ("positions", {"positions": HOME[:-1]}),
        ("velocities", {"velocities": [0.0] * 7}),
        ("accelerations", {"accelerations": []}),
        ("limits.positions", {"limits": m.GoalLimits(positions=[None])}),
        ("limits.jerks", {"limits": m.GoalLimits(jerks=[1.0])}),
        ("waypoints[1].velocities", {"waypoints": [m.Waypoint(time_from_start=0.2), SHORT]}),
    ],
)
def test_lists_of_the_wrong_length_are_refused_with_field_and_joint_count(
    primitive: Primitive, field: str, fields: dict[str, object]
):
    refusal = refused(primitive, **fields)
    assert (refusal.code, refusal.detail["field"]) == ("bad_message", field)
    assert f"the arm has {JOINTS} joints" in refusal.message


def test_an_alternative_too_far_ahead_is_refused_with_its_index(primitive: Primitive):
    alternatives = [m.Alternative(), m.Alternative(arrival_time=900.0)]
    goal = m.Goal(primitive="forehand", positions=HOME, alternatives=alternatives)
    with pytest.raises(Refusal, match=r"^alternatives\[1\]\.arrival_time 900.0 s") as caught:
        ends(goal, primitive, motion_request(goal, primitive, ROBOT, ORIGIN), ROBOT, ORIGIN)
    assert caught.value.code == "invalid_goal"


def test_a_primitive_with_another_joint_count_is_refused(primitive: Primitive):
    fewer = replace(primitive, control_points=primitive.control_points[:-1], spread=primitive.spread[:-1])
    refusal = refused(fewer)
    assert (refusal.code, refusal.detail["field"]) == ("invalid_goal", "primitive")


@pytest.mark.parametrize(
    ("error", "code", "detail"),
    [
        (
            LimitExceeded(2, "velocity", 13.0, 12.0),
            "limit",
            {"joint": "joint_3", "quantity": "velocity", "value": 13.0, "bound": 12.0},
        ),
        (
            Infeasible(1, "jerk", 0.25, (-9.0, 9.0), 0.9, [0.3]),
            "infeasible",
            {
                "joint": "joint_2",
                "quantity": "jerk",
                "time_from_start": 0.25,
                "min_duration": 0.9,
                "waypoint_times": [0.3],
            },
        ),
        (CannotStop(0, 3.5), "cannot_stop", {"joint": "joint_1", "max_velocity": 3.5}),
        (CannotStop(0, None), "cannot_stop", {"joint": "joint_1", "max_velocity": None}),
        (SolverFailed(5, "MAX_ITER"), "solver_failed", {"joint": "joint_6", "status": "MAX_ITER"}),
        (InvalidMotion("goal.velocities", "must be finite"), "invalid_goal", {"field": "velocities"}),
    ],
)
def test_errors_of_motion_become_refusals(error: MotionError, code: str, detail: dict[str, object]):
    """The message has the joint's name instead of its index."""
    refusal = refusal_of(error, joints_of(ROBOT))
    assert (refusal.code, refusal.detail) == (code, detail)
    assert str(detail.get("joint", "velocities")) in refusal.message
    assert not any(f"joint {index}:" in refusal.message for index in range(JOINTS))


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (LimitExceeded(1, "jerk", 600.0, 500.0), "lift: the requested jerk 600 m/s³ lies outside the limits"),
        (LimitExceeded(0, "jerk", 600.0, 500.0), "turn: the requested jerk 600 rad/s³ lies outside the limits"),
        (PlanExceeds(1, "position", 0.9, 0.4), "lift: the position of the plan reaches 0.9 m, but it must be at most"),
        (CannotStop(1, 0.5), "a final velocity of 0.5 m/s could be stopped"),
        (TorqueExceeded(1, 90.0, 80.0, 0.2), "lift: needs a torque of 90 N, first more than its 80 N at 0.200 s"),
    ],
)
def test_a_refusal_has_the_units_of_its_joint(error: MotionError, words: str):
    """m and N for a slide, rad and N·m for a hinge."""
    assert words in refusal_of(error, Joints(("turn", "lift"), (False, True))).message
