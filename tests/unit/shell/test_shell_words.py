"""Parsing of the command line: vectors, waypoints, goals."""

import numpy as np
import pytest

from client import tool
from protocol import messages as m
from tools.shell import joints
from tools.shell.arm import check_flags
from tools.shell.goal import GoalFlags, check, to_fields
from tools.shell.shell import UsageError


def to_message(flags: GoalFlags) -> m.Goal:
    """Return the goal that flags describe for an arm of three joints."""
    return m.Goal(primitive=flags.primitive, **to_fields(flags, lambda: 3))  # type: ignore[arg-type]


def test_vectors_are_parsed():
    assert joints.vector(["1", "-.5", "2e-3"], "--positions") == [1.0, -0.5, 0.002]
    assert joints.vector(["1", "2"], "--positions") == [1.0, 2.0]
    assert joints.partial(["1", "_", "0"], "--accelerations") == [1.0, None, 0.0]
    assert joints.ranges(["_", "0:.5", "_"], "--limit-positions") == [None, (0.0, 0.5), None]


@pytest.mark.parametrize(
    ("parse", "words", "sentence"),
    [
        (joints.vector, ["1", "_", "2"], "--x: '_' is not a finite number"),
        (joints.vector, ["1", "nan", "2"], "--x: 'nan' is not a finite number"),
        (joints.partial, ["1", "inf", "2"], "--x: 'inf' is not a finite number"),
        (joints.ranges, ["1", "0:1", "_"], "--x: '1' is not a range; write LOW:HIGH, or _ for the robot's own"),
        (joints.ranges, ["0:", "0:1", "_"], "--x: '' is not a finite number"),
    ],
)
def test_malformed_vectors_are_refused(parse, words, sentence):
    with pytest.raises(UsageError) as error:
        parse(words, "--x")
    assert str(error.value) == sentence


def test_waypoints_are_parsed():
    positions = joints.waypoint("0.5:0.1,_,-2")
    assert positions == m.Waypoint(time_from_start=0.5, positions=[0.1, None, -2.0])
    assert joints.waypoint("0.5::1,_,_") == m.Waypoint(time_from_start=0.5, velocities=[1.0, None, None])
    both = joints.waypoint(".5:0,0,0:1,_,_")
    assert both == m.Waypoint(time_from_start=0.5, positions=[0.0, 0.0, 0.0], velocities=[1.0, None, None])


@pytest.mark.parametrize("text", ["0.5", "0.5:", "0.5::", "0.5:1,2,3:4,5,6:7", "soon:1,2,3", "0.5:1,two"])
def test_malformed_waypoints_are_refused(text):
    with pytest.raises(UsageError, match=r"^--waypoint"):
        joints.waypoint(text)


def test_alternatives_are_parsed():
    end = joints.alternative("0.8:1,2,3:0,0,1:_,0,_")
    assert end == m.Alternative(
        duration=0.8, positions=[1.0, 2.0, 3.0], velocities=[0.0, 0.0, 1.0], accelerations=[None, 0.0, None]
    )
    assert joints.alternative("@12.5:") == m.Alternative(arrival_time=12.5)
    assert joints.alternative(":1,2,3") == m.Alternative(positions=[1.0, 2.0, 3.0])
    assert joints.alternative("::0,0,1") == m.Alternative(velocities=[0.0, 0.0, 1.0])


@pytest.mark.parametrize("text", ["", "0.8", ":", "soon:", "@:", "1:2,x", "1:_,2,3", "1:1,2,3:::"])
def test_malformed_alternatives_are_refused(text):
    with pytest.raises(UsageError, match=r"^--alternative"):
        joints.alternative(text)


def test_corrections_and_ends_from_flags():
    flags = GoalFlags(
        primitive="forehand",
        alternative=("0.5:", "@3:1,2,3"),
        revises="g1",
        place_time=0.5,
        follow_through=0.1,
        method="gaussian",
    )
    assert to_message(flags) == m.Goal(
        primitive="forehand",
        alternatives=[m.Alternative(duration=0.5), m.Alternative(arrival_time=3.0, positions=[1.0, 2.0, 3.0])],
        revises="g1",
        place_time=0.5,
        follow_through=0.1,
        method="gaussian",
    )
    assert to_message(GoalFlags(primitive="forehand", fastest=True)).fastest


def test_goal_from_flags():
    flags = GoalFlags(
        primitive="forehand",
        positions=("1", "2", "3"),
        velocities=("0", "0", "1"),
        accelerations=("_", "0", "_"),
        duration=0.8,
        waypoint=("0.5:0.1,_,_",),
        limit_velocities=("8",),
        rest_fraction=0.25,
        goal_id="g1",
        no_preempt=True,
    )
    assert to_message(flags) == m.Goal(
        primitive="forehand",
        positions=[1.0, 2.0, 3.0],
        velocities=[0.0, 0.0, 1.0],
        accelerations=[None, 0.0, None],
        duration=0.8,
        waypoints=[m.Waypoint(time_from_start=0.5, positions=[0.1, None, None])],
        limits=m.GoalLimits(velocities=[8.0, 8.0, 8.0]),
        rest_fraction=0.25,
        goal_id="g1",
        preempt=False,
    )


def test_a_tool_goal_from_flags():
    place, still = ("0.4", "-.1", "0.5"), (0.0, 0.0, 0.0)
    flags = GoalFlags(
        primitive="wave",
        tool=place,
        tool_axis=("0", "0", "-1"),
        tool_velocity=("0.3", "0", "0"),
        tool_waypoint=("0.5:.4,0,.3", ".6:.4,0,.3:0,0,1:0,0,0", "0.7:.4,0,.3:1,0,0,0"),
    )
    made = to_message(flags)
    assert made.tool == m.ToolGoal(position=(0.4, -0.1, 0.5), axis=(0.0, 0.0, -1.0), velocity=(0.3, 0.0, 0.0))
    at = (0.4, 0.0, 0.3)
    assert made.waypoints == [
        m.Waypoint(time_from_start=0.5, tool=m.ToolGoal(position=at)),
        m.Waypoint(time_from_start=0.6, tool=m.ToolGoal(position=at, axis=(0.0, 0.0, 1.0), velocity=still)),
        m.Waypoint(time_from_start=0.7, tool=m.ToolGoal(position=at, orientation=(1.0, 0.0, 0.0, 0.0))),
    ]
    assert made.tool == tool([0.4, -0.1, 0.5], axis=np.array([0, 0, -1]), velocity=(0.3, 0, 0)), (
        "the same as the client library's"
    )


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        ({"tool": ("1", "2")}, "--tool: needs 3 numbers, and these are 2"),
        ({"tool": ("1", "2", "x")}, "--tool: 'x' is not a finite number"),
        ({"tool_axis": ("0", "0", "1")}, "--tool-axis needs --tool X Y Z"),
        ({"tool_waypoint": ("0.5",)}, "--tool-waypoint 0.5: write TIME:X,Y,Z"),
        ({"tool_waypoint": ("0.5:1,2",)}, "--tool-waypoint 0.5:1,2: needs 3 numbers"),
        ({"tool_waypoint": ("0.5:1,2,3:1,2",)}, "needs 3 numbers, and these are 2"),
    ],
)
def test_malformed_tool_goals_are_refused(flags, said):
    with pytest.raises(UsageError) as caught:
        to_message(GoalFlags(primitive="wave", **flags))
    assert said in str(caught.value)


def test_a_goal_with_its_own_start_from_flags():
    flags = GoalFlags(
        primitive="forehand",
        positions=("1",),
        plan_only=True,
        start_positions=("2",),
        start_accelerations=("_",),
        tail="coast",
    )
    goal = to_message(flags)
    assert goal.start == m.Start(positions=[2.0], accelerations=[None])
    assert (goal.tail, goal.limits, goal.velocities) == ("coast", None, None)


@pytest.mark.parametrize(
    ("flags", "sentence"),
    [
        ({"start_velocities": ("1",), "plan_only": True}, "need --start-positions"),
        ({"plan_only": True, "wait": True}, "--plan-only moves nothing"),
        ({"plan_only": True, "lease": True}, "--plan-only moves nothing"),
    ],
)
def test_contradictory_flags_are_refused(flags, sentence):
    with pytest.raises(UsageError, match=sentence):
        check(GoalFlags(primitive="forehand", positions=("1",), **flags))


@pytest.mark.parametrize(
    ("kind", "given", "sentence"),
    [
        ("noise", {"--position-std", "--values"}, "disturb noise does not take --values"),
        ("torque", {"--at"}, "disturb torque needs --duration and --values"),
        ("loss", {"--stream", "--duration", "--at"}, "disturb loss does not take --at"),
    ],
)
def test_flags_of_another_disturbance_are_refused(kind, given, sentence):
    with pytest.raises(UsageError, match=f"^{sentence}$"):
        check_flags(kind, given)
