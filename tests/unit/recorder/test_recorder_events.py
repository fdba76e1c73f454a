"""Results, refusals, contacts, the ball, disturbances and the racket in the trace."""

import msgspec
import numpy as np
import pytest

from protocol import messages as m
from protocol.topics import BALL, CONTACT, DISTURBANCE, ENDED, REFUSED, STATE
from robot.kinematics import Kinematics
from tests.unit.recorder.recorder_messages import RUN, VALUES, push, refused, result, state
from tests.unit.recorder.recorder_to_file import CONFIG, RecorderToFile


def test_a_result_is_written_with_its_event(recorder: RecorderToFile) -> None:
    recorder.publish(STATE, *(state(tick) for tick in range(10)))
    recorder.publish(ENDED, result("aborted", reason="fault"))
    trace = recorder.read()
    assert trace.column("/goals", "outcome").values == [["aborted"]]
    assert trace.column("/goals", "accepted").values == [[RUN + 2]]
    assert trace.column("/goals", "peak_tracking_error").values == [[0.0625]]
    assert trace.scalars("/goals/position_error").tolist() == [VALUES]
    assert trace.column("/goals/velocity_error").ticks().tolist() == [2]
    assert "goal g1 aborted (fault)" in trace.texts("/events/goal")[0]


def test_a_refused_goal_is_a_warning_at_the_arms_tick(recorder: RecorderToFile) -> None:
    """With its id if it has one, among the events of other goals."""
    for tick in range(10):
        recorder.publish(STATE, state(tick), at=100 + tick)
    recorder.publish(REFUSED, refused(), at=104)
    recorder.publish(REFUSED, refused(goal_id=None), at=107)
    trace = recorder.read()
    why = "refused as limit: joint_1 would end at 2.5 rad"
    assert trace.texts("/events/goal") == [f"goal g2 {why}", f"a goal {why}"]
    assert trace.column("/events/goal", "TextLog:text").times["tick"].tolist() == [4, 7]
    assert trace.column("/events/goal", "TextLog:level").values == [["WARN"]] * 2
    wanted = {
        "goal_id": ["g2", ""],
        "client_id": ["shell-1"] * 2,
        "primitive": ["forehand"] * 2,
        "code": ["limit"] * 2,
        "requested": [RUN] * 2,
    }
    for name, values in wanted.items():
        assert trace.column("/goals/refused", name).values == [[value] for value in values], name


def test_contacts_and_ball_positions_are_written(recorder: RecorderToFile) -> None:
    places = [[0.1 * k, 1 / 3, -0.7] for k in range(5)]
    recorder.publish(STATE, *(state(tick) for tick in range(50)))
    touch = m.Contact(time=0.012, bodies=["racket", "ball"], impulse=0.02, ball_velocity=None, ended=False)
    recorder.publish(
        CONTACT, touch, msgspec.structs.replace(touch, impulse=0.42, ball_velocity=[3.0, 0.0, 4.0], ended=True)
    )
    recorder.publish(
        BALL, *(m.BallState(time=k / 100, position=place, velocity=[0.0] * 3) for k, place in enumerate(places))
    )
    trace = recorder.read()
    assert trace.scalars("/contacts").tolist() == [0.42]
    assert trace.column("/contacts").ticks().tolist() == [12]
    assert trace.texts("/events/contact") == [
        "racket and ball touch",
        "racket and ball parted after 0.420 N·s, the ball leaves at 5.00 m/s",
    ]
    assert trace.scalars("/ball/position").tolist() == places
    tee = np.array(trace.column("/world/tee", "Transform3D:translation").values)
    assert tee.reshape(-1) == pytest.approx([0.0, 1 / 3, -0.733], abs=1e-6)


def test_disturbances_are_written_as_steps_lanes_and_arrows(recorder: RecorderToFile) -> None:
    recorder.publish(STATE, *(state(tick) for tick in range(50)))
    recorder.publish(
        DISTURBANCE, push(0.010, acceleration=[30.0, 0, 0, 0, 0, 0], torque=[0, -2.0, 0, 0, 0, 0]), push(0.030)
    )
    trace = recorder.read()
    steps = trace.column("/joints/joint_1/disturbance/acceleration")
    assert list(zip(steps.ticks().tolist(), steps.array().tolist(), strict=True)) == [
        (9, 0.0),
        (10, 30.0),
        (29, 30.0),
        (30, 0.0),
    ]
    assert trace.scalars("/joints/joint_2/disturbance/torque").tolist() == [0.0, -2.0, -2.0, 0.0]
    lane = trace.column("/lanes/disturbance", "StateChange:state")
    assert lane.values == [["acceleration + torque"], [""]]
    arrows = trace.column("/world/shoulder/push", "Arrows3D:vectors")
    assert [len(row) for row in arrows.values] == [1, 0]
    assert [len(row) for row in trace.column("/world/upper_arm/push", "Arrows3D:vectors").values] == [1, 0]


def test_the_rackets_pose_agrees_with_the_kinematics(recorder: RecorderToFile) -> None:
    """Quaternions are in Rerun's order; the tool is fixed relative to the racket."""
    states = [state(tick) for tick in range(60)]
    recorder.publish(STATE, *states)
    trace = recorder.read()
    places = trace.column("/world/racket", "Transform3D:translation")
    turns = trace.column("/world/racket", "Transform3D:quaternion")
    assert places.times["tick"].tolist() == [0, 10, 20, 30, 40, 50]
    kinematics = Kinematics(CONFIG)
    for tick, place, turn in zip(places.times["tick"].tolist(), places.values, turns.values, strict=True):
        x, y, z, w = turn[0]
        local = np.array([0.0, 0.0, 0.39])  # the tool's site in the racket's frame
        vector = np.array([x, y, z])
        turned = local + 2 * np.cross(vector, np.cross(vector, local) + w * local)
        tool, _ = kinematics.tool_pose(np.array(states[tick].positions))
        assert np.array(place[0]) + turned == pytest.approx(tool, abs=1e-5)
