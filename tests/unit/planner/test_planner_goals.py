"""Goals become requests of motion: defaults, rounding, limits, alternatives."""

import numpy as np
import pytest

from motion.primitive import Primitive
from protocol import messages as m
from protocol.errors import Refusal
from services.planner.corrections import Corrections
from services.planner.goals import ends, motion_request, origin_of
from tests.unit.planner.goal_requests import FREE, HOME, ORIGIN, ROBOT, goal, refused, requested


def test_without_positions_the_end_is_the_primitives_own(primitive: Primitive):
    """With the primitive's final velocities, unless others are given."""
    request = requested(primitive, positions=None)
    assert request.goal.positions.tolist() == primitive.goal.positions.tolist()
    assert request.goal.velocities.tolist() == primitive.goal.velocities.tolist()
    assert requested(primitive, positions=None, velocities=HOME).goal.velocities.tolist() == HOME


def test_omitted_fields_have_defaults(primitive: Primitive):
    """Zero final velocities, free final accelerations, the demonstration's duration, the robot's limits."""
    request = requested(primitive)
    assert request.goal.positions.tolist() == HOME
    assert not request.goal.velocities.any()
    assert np.isnan(request.goal.accelerations).all()
    assert request.duration == pytest.approx(0.734, abs=1e-12)
    assert request.limits is ROBOT.limits
    assert (request.waypoints, request.rest_fraction, request.tail) == ((), 0.0, "stop")
    assert request.start is ORIGIN.boundary


@pytest.mark.parametrize(
    ("fields", "duration"),
    [
        ({"duration": 0.5}, 0.5),
        ({"duration": 0.5001}, 0.501),
        ({"duration": 0.3 * 3}, 0.9),
        ({"duration": 60.0}, 60.0),
        ({"arrival_time": 2.5004}, 0.5),
        ({"arrival_time": 2.5006}, 0.501),
        ({"arrival_time": 62.0}, 60.0),
    ],
)
def test_durations_are_whole_ticks(primitive: Primitive, fields: dict[str, object], duration: float):
    """Durations are rounded up; with an arrival time, to the nearest tick."""
    assert requested(primitive, **fields).duration == pytest.approx(duration, abs=1e-12)


def test_a_waypoint_at_time_zero_at_the_start_is_left_out(primitive: Primitive):
    """Many clients send the arm's estimated position as their first point."""
    start = m.Waypoint(time_from_start=0.0, positions=[HOME[0] + 0.005, *HOME[1:]])
    later = m.Waypoint(time_from_start=0.5, positions=HOME)
    kept = requested(primitive, waypoints=[start, later]).waypoints
    assert [waypoint.time_from_start for waypoint in kept] == [0.5]
    elsewhere = m.Waypoint(time_from_start=0.0, positions=[HOME[0] + 0.05, *HOME[1:]])
    assert refused(primitive, waypoints=[elsewhere]).detail["field"] == "waypoints[0].time_from_start"


def test_alternatives_override_the_goals_fields(primitive: Primitive):
    """Durations are whole ticks; arrival times count from the motion's start."""
    goal = m.Goal(
        primitive="forehand",
        positions=HOME,
        velocities=[0.1] * 6,
        duration=1.0,
        alternatives=[m.Alternative(duration=0.7001), m.Alternative(positions=[0.2] * 6, arrival_time=2.5)],
    )
    found, late = ends(goal, primitive, motion_request(goal, primitive, ROBOT, ORIGIN), ROBOT, ORIGIN)
    own, shorter, elsewhere = found.values()
    assert not late
    assert (own.duration, shorter.duration, elsewhere.duration) == pytest.approx((1.0, 0.701, 0.5))
    assert own.goal.positions.tolist() == shorter.goal.positions.tolist() == HOME
    assert elsewhere.goal.positions.tolist() == [0.2] * 6
    assert elsewhere.goal.velocities.tolist() == [0.1] * 6


def test_a_late_alternative_is_left_out(primitive: Primitive):
    """The other ends remain."""
    alternatives = [m.Alternative(arrival_time=1.0), m.Alternative(duration=0.5)]
    goal = m.Goal(primitive="forehand", positions=HOME, alternatives=alternatives)
    found, late = ends(goal, primitive, motion_request(goal, primitive, ROBOT, ORIGIN), ROBOT, ORIGIN)
    assert (list(found), list(late)) == ([0, 2], [1])
    assert str(late[1]).startswith("alternatives[0].arrival_time 1.0 s")
    assert late[1].code == "late"


def test_a_late_goal_has_alternatives(primitive: Primitive):
    """Its own end is left out, and so are alternatives without a time of their own."""
    alternatives = [m.Alternative(duration=0.5), m.Alternative(positions=[0.2] * 6)]
    goal = m.Goal(primitive="forehand", positions=HOME, arrival_time=1.0, alternatives=alternatives)
    found, late = ends(goal, primitive, motion_request(goal, primitive, ROBOT, ORIGIN), ROBOT, ORIGIN)
    assert (list(found), list(late)) == ([1], [0, 2])
    assert late[2].message.startswith("arrival_time 1.0 s has passed")


def test_limits_are_the_tighter_of_goal_and_robot(primitive: Primitive):
    """Null stands for the robot's limit."""
    limits = m.GoalLimits(
        positions=[(-9.0, 0.5), *FREE], velocities=[2.0, 99.0, *[None] * 4], accelerations=None, jerks=[100.0, *FREE]
    )
    got = requested(primitive, limits=limits).limits
    assert got.positions[0].tolist() == [ROBOT.limits.positions[0, 0], 0.5]
    assert got.positions[1:].tolist() == ROBOT.limits.positions[1:].tolist()
    assert got.velocities[:2].tolist() == [2.0, ROBOT.limits.velocities[1]]
    assert got.accelerations.tolist() == ROBOT.limits.accelerations.tolist()
    assert got.jerks[:2].tolist() == [100.0, ROBOT.limits.jerks[1]]


def test_null_leaves_accelerations_and_waypoint_entries_free(primitive: Primitive):
    """Velocities that a start omits are zero."""
    request = requested(
        primitive,
        accelerations=[1.0, *FREE],
        waypoints=[m.Waypoint(time_from_start=0.2, positions=[0.1, *FREE])],
    )
    assert request.goal.accelerations[0] == 1.0
    assert np.isnan(request.goal.accelerations[1:]).all()
    waypoint = request.waypoints[0]
    assert waypoint.positions[0] == 0.1
    assert np.isnan(waypoint.positions[1:]).all()
    assert np.isnan(waypoint.velocities).all()
    start = origin_of(goal(start=m.Start(positions=HOME)), None, Corrections(), ROBOT).boundary
    assert not start.velocities.any()
    assert np.isnan(start.accelerations).all()
    with pytest.raises(Refusal) as caught:
        origin_of(goal(start=m.Start(positions=HOME, accelerations=[0.0])), None, Corrections(), ROBOT)
    assert caught.value.detail["field"] == "start.accelerations"
