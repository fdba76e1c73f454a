"""The fields of a goal, as the arm plays them, and what its refusals offer."""

import msgspec
import numpy as np
import pytest
from harness import ROBOT, Reference, Stack
from strike_requests import HOME, STRIKE, strike, trajectory_of

from motion.trajectory import Samples
from protocol import messages as m
from protocol import topics
from protocol.errors import Refusal
from robot.conversions import samples_of

JOINT_1 = [None] * 5


def test_rest_fraction_ends_without_acceleration(stack: Stack):
    """The last 30 % of the motion have the final velocity and no acceleration."""
    reply = strike(stack, rest_fraction=0.3, duration=1.2, include_trajectory=True)
    assert reply.trajectory is not None
    samples, hit = samples_of(reply.trajectory), reply.trajectory.hit_index
    straight = slice(hit - 359, hit)
    assert not samples.accelerations[straight].any()
    assert np.abs(samples.velocities[straight] - STRIKE.velocities).max() < 1e-9
    assert np.abs(samples.positions[hit] - STRIKE.positions).max() < 1e-9
    assert np.abs(samples.accelerations[hit - 400]).max() > 1.0
    assert stack.finish(reply).outcome == "succeeded"


def test_waypoints_between_two_ticks_are_met(stack: Stack):
    """The curve between two samples meets the values that a waypoint prescribes; null leaves a value free."""
    waypoints = [
        m.Waypoint(time_from_start=0.30337, positions=[-0.5, None, 0.9, None, None, None]),
        m.Waypoint(time_from_start=0.61234, positions=None, velocities=[0.5, None, None, -1.0, None, None]),
    ]
    reply = strike(stack, waypoints=waypoints, include_trajectory=True)
    assert reply.trajectory is not None
    samples = samples_of(reply.trajectory)
    for waypoint in waypoints:
        index = int(waypoint.time_from_start * 1000)
        late = waypoint.time_from_start - index * ROBOT.tick
        p, v, a = samples.positions[index], samples.velocities[index], samples.accelerations[index]
        jerk = (samples.accelerations[index + 1] - a) / ROBOT.tick
        there = p + late * (v + late * (a / 2 + late * jerk / 6)), v + late * (a + late * jerk / 2)
        for wanted, got in zip((waypoint.positions, waypoint.velocities), there, strict=True):
            pairs = [(w, g) for w, g in zip(wanted or [], got, strict=False) if w is not None]
            assert all(abs(w - g) < 1e-5 for w, g in pairs), pairs
    assert stack.finish(reply).outcome == "succeeded"


def test_arrival_time_is_kept(stack: Stack):
    """The hit is at the arrival time on the robot's clock, rounded to the nearest tick."""
    stack.step(100)
    reply = strike(stack, arrival_time=1.4567, include_trajectory=True)
    assert reply.start_time + reply.duration == pytest.approx(1.457, abs=1e-9)
    result = stack.finish(reply)
    assert result.hit is not None
    assert result.hit.time == pytest.approx(1.457, abs=1e-9)


def test_duration_is_rounded_up_to_a_tick(stack: Stack):
    """A duration between two ticks becomes the longer one."""
    assert strike(stack, duration=0.9001, plan_only=True).duration == pytest.approx(0.901, abs=1e-12)
    assert strike(stack, duration=0.9, plan_only=True).duration == pytest.approx(0.9, abs=1e-12)
    assert strike(stack, plan_only=True).duration == pytest.approx(1.0, abs=1e-12)


def test_given_final_accelerations_are_met(stack: Stack):
    """Final accelerations are met where they are given; null leaves them free."""
    reply = strike(stack, accelerations=[20.0, None, -5.0, None, 0.0, None], include_trajectory=True)
    assert reply.trajectory is not None
    last = samples_of(reply.trajectory).accelerations[reply.trajectory.hit_index]
    assert np.abs(last[[0, 2, 4]] - [20.0, -5.0, 0.0]).max() < 1e-6
    assert stack.finish(reply).outcome == "succeeded"


def test_limits_of_a_goal_are_kept(stack: Stack):
    """The tighter of the goal's and the robot's limits holds, up to the hit and in the stop."""
    limits = m.GoalLimits(
        positions=[(-0.95, 0.5), *JOINT_1],
        velocities=[5.0, 100.0, None, None, None, None],
        accelerations=[60.0, *JOINT_1],
        jerks=[5000.0, *JOINT_1],
    )
    free = samples_of(trajectory_of(stack, duration=1.1))
    assert np.abs(free.accelerations[:, 0]).max() > 60.0
    reply = strike(stack, duration=1.1, limits=limits, include_trajectory=True)
    assert reply.trajectory is not None
    assert reply.report.certified
    first = [values[:, 0] for values in _quantities(samples_of(reply.trajectory))]
    assert first[0].min() >= -0.95 - 1e-6
    assert first[0].max() <= 0.5 + 1e-6
    for values, bound in zip(first[1:], (5.0, 60.0, 5000.0), strict=True):
        assert np.abs(values).max() <= bound * (1 + 1e-6)
    assert ("joint_1", "position") in {(active.joint, active.quantity) for active in reply.report.active}
    assert stack.finish(reply).outcome == "succeeded"


def _quantities(samples: Samples) -> list[np.ndarray]:
    accelerations = samples.accelerations
    return [samples.positions, samples.velocities, accelerations, np.diff(accelerations, axis=0) * 1000]


@pytest.mark.parametrize("waypoints", [[], [m.Waypoint(time_from_start=0.015, positions=[0.1, *JOINT_1])]])
def test_the_shortest_duration_offered_works(stack: Stack, waypoints: list[m.Waypoint]):
    """An infeasible goal's refusal offers a duration and waypoint times; a goal with these is played."""
    with pytest.raises(Refusal) as caught:
        strike(stack, duration=0.03, waypoints=waypoints)
    refusal = caught.value
    assert refusal.code == "infeasible"
    detail = refusal.detail
    assert detail["joint"] in ROBOT.joint_names
    assert 0.0 <= detail["time_from_start"] <= 0.03
    assert detail["min_duration"] > 0.03
    again = [
        msgspec.structs.replace(w, time_from_start=t)
        for w, t in zip(waypoints, detail["waypoint_times"] or [], strict=True)
    ]
    reply = strike(stack, duration=detail["min_duration"], waypoints=again)
    assert reply.report.certified
    assert stack.finish(reply).outcome == "succeeded"


def test_a_velocity_just_below_the_largest_can_be_stopped(stack: Stack):
    """The refusal of a goal near a joint's limit names the largest velocity that can be stopped."""
    body = {"primitive": "forehand", "positions": [2.1, *HOME[1:]], "duration": 1.0}
    refusal = stack.refused_goal(**body, velocities=[10.0] + [0.0] * 5)
    assert refusal.code == "cannot_stop"
    assert refusal.detail["joint"] == "joint_1"
    fastest = refusal.detail["max_velocity"]
    assert 0.5 < fastest < 10.0
    assert stack.refused_goal(**body, velocities=[fastest * 1.01] + [0.0] * 5).code == "cannot_stop"
    reply = stack.goal(**body, velocities=[fastest * 0.999] + [0.0] * 5)
    assert stack.finish(reply).outcome == "succeeded"
    Reference(stack.commands()).check_limits()


def test_a_plan_may_coast(stack: Stack):
    """A plan-only goal with the tail `coast` ends at the hit, in motion."""
    reply = strike(stack, tail="coast", plan_only=True, include_trajectory=True)
    assert reply.trajectory is not None
    assert reply.total_duration == reply.duration
    assert np.abs(samples_of(reply.trajectory).velocities[-1] - STRIKE.velocities).max() < 1e-9


def test_the_result_is_published(stack: Stack):
    """Every goal that ends is published with its result; the recoil may still grow after that."""
    reply = strike(stack)
    result = stack.finish(reply)
    while (ended := stack.next(topics.ENDED)).goal_id != reply.goal_id:
        pass
    assert result.recoil is not None
    assert ended == msgspec.structs.replace(result, recoil=ended.recoil)
