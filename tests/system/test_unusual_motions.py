"""Motions with a place time, by the paper's method, of a minute, and with values of limited precision."""

import numpy as np
import pytest
from harness import ROBOT, Reference, Stack, check_end

from deploy.demonstrations.make_forehand import FOREHAND, HIT, HIT_VELOCITIES
from motion.demonstration import Demonstration
from motion.primitive import Primitive, learn
from protocol import messages as m
from robot.conversions import samples_of
from tools.demo.strikes import FASTER, TIGHT

LIMITS = ROBOT.limits.positions
HOME = ROBOT.home.tolist()


def taught() -> Primitive:
    """Return the forehand as the planner has learned it."""
    recorded = np.loadtxt(FOREHAND, delimiter=",", skiprows=1)
    return learn(Demonstration(recorded[:, 0], recorded[:, 1:]))


def test_a_place_time_keeps_the_places_in_the_middle(stack: Stack):
    """With a place time, the goal's offset is made up near the end only; without it, along the whole way."""
    slow = [velocity / 3 for velocity in HIT_VELOCITIES]
    fields = {"positions": [place + 0.1 for place in HIT], "velocities": slow, "duration": 3.0}
    shown = taught().positions(np.linspace(0, 0.7, 2101))
    apart = []
    for seconds in (None, 0.1):  # in seconds of the demonstration; this motion is three times slower
        trajectory = stack.goal(**fields, place_time=seconds, plan_only=True, include_trajectory=True).trajectory
        assert trajectory is not None
        apart.append(np.abs(samples_of(trajectory).positions[:2101] - shown).max())
    assert apart[1] < apart[0] / 3
    check_end(stack, stack.goal(**fields, place_time=0.1))


def test_the_papers_method_is_played(stack: Stack):
    """A motion of method `gaussian` is played if its samples keep the limits; it is not certified between them."""
    reply = stack.strike(method="gaussian", duration=1.1)
    assert not reply.report.certified
    check_end(stack, reply)
    best = stack.strike(duration=1.1, start=m.Start(positions=HOME), plan_only=True).report
    assert np.all(np.array(best.imitation_rms) <= 1.001 * np.array(reply.report.imitation_rms) + 1e-6)


def test_the_papers_method_under_limits(stack: Stack):
    """The paper's method keeps limits at its samples only.

    Volley's plan is certified and imitates as well or better.
    """
    fields = {"positions": list(HIT), "velocities": list(FASTER), "duration": 0.8, "limits": TIGHT}
    planned = stack.goal(**fields, method="gaussian", plan_only=True)
    margin = planned.report.margin
    assert not planned.report.certified
    assert -1e-5 < min(value for value in (*margin.positions, *margin.velocities) if value is not None) < 5e-3
    best = stack.goal(**fields, plan_only=True).report
    assert best.certified
    assert np.all(np.array(best.imitation_rms) < 1.02 * np.array(planned.report.imitation_rms))
    check_end(stack, stack.goal(**fields, method="gaussian"))


def test_a_motion_of_a_minute_is_accepted(stack: Stack):
    """The controller gets polynomials; the reply and the published plan have every third sample.

    Then it is cancelled.
    """
    reply = stack.goal(duration=59.0, include_trajectory=True)
    assert reply.duration == 59.0
    trajectory = reply.trajectory
    assert trajectory is not None
    assert trajectory.dt == pytest.approx(3 * ROBOT.tick)
    assert trajectory.count == -(-round(reply.total_duration * ROBOT.rate_hz) // 3) + 1
    assert trajectory.hit_index == round(59_000 / 3)
    assert trajectory.pieces is not None
    assert stack.plan_of(reply).count == trajectory.count
    stack.step(500)
    canceled = stack.cancel(reply.goal_id)
    stack.step_to(stack.ticks(canceled.stop_time) + 1)
    assert stack.result(reply.goal_id).outcome == "canceled"
    samples, first = samples_of(trajectory), stack.ticks(reply.start_time)
    played = Reference(stack.commands()).positions[first : first + 300 : 3]
    assert np.abs(played - samples.positions[:100]).max() < 1e-9
    assert stack.refused_goal(duration=60.0, velocities=list(HIT_VELOCITIES)).code == "invalid_goal"
    assert stack.refused_goal(duration=60.1).code == "invalid_goal"


@pytest.mark.parametrize("side", [0, 1])
def test_a_float32_goal_on_a_limit_is_accepted(stack: Stack, side: int):
    """A limit rounded outwards to float32 lies beyond the limit; the goal is moved onto it.

    The racket would be in the floor there, so the goal is sent without the collision check.
    """
    outwards = np.float32(np.inf if side else -np.inf)
    goal = [float(np.nextafter(np.float32(limit), outwards)) for limit in LIMITS[:, side]]
    assert all(abs(value) > abs(limit) for value, limit in zip(goal, LIMITS[:, side], strict=True))
    reply = stack.goal(positions=goal, duration=2.0, checks=m.Checks(collision=False))
    assert reply.positions == LIMITS[:, side].tolist()
    check_end(stack, reply)


def test_a_goal_beyond_a_limit_is_not_rounding(stack: Stack):
    """A goal further than a millionth of the range beyond its limit is refused."""
    refusal = stack.refused_goal(positions=[float(LIMITS[0, 1]) + 1e-4, *HIT[1:]], duration=2.0)
    assert (refusal.code, refusal.detail["joint"]) == ("limit", "joint_1")


def test_a_waypoint_that_repeats_the_start_is_left_out(stack: Stack):
    """Many clients send the start as first waypoint; it is ignored. A waypoint at time 0 elsewhere is refused."""
    through = m.Waypoint(time_from_start=0.5, positions=[-0.6, *[None] * 5])
    repeated = m.Waypoint(time_from_start=0.0, positions=HOME)
    reply = stack.strike(waypoints=[repeated, through])
    played_without = stack.strike(waypoints=[through], plan_only=True, start=m.Start(positions=HOME))
    assert reply.duration == played_without.duration
    check_end(stack, reply)
    stack.reset()
    elsewhere = m.Waypoint(time_from_start=0.0, positions=list(HIT))
    refusal = stack.refused_goal(waypoints=[elsewhere])
    assert (refusal.code, refusal.detail["field"]) == ("invalid_goal", "waypoints[0].time_from_start")
