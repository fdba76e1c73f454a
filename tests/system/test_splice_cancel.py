"""Goals that replace a motion, cancel it or are refused while it runs, and goals of every kind."""

import msgspec
import numpy as np
import pytest
from harness import ROBOT, Reference, Stack, wait_for

from motion.braking import first_stop
from motion.trajectory import Samples
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.errors import Refusal
from robot.conversions import samples_of
from tools.demo.strikes import goal

HOME = ROBOT.home.tolist()
STRIKE = goal()
TENTHS = pytest.mark.parametrize("tenth", range(11))
JOINT_1 = [None] * 5


def strike(stack: Stack, **fields: object) -> m.GoalReply:
    """Begin the demonstrated strike."""
    return stack.bus.ask(topics.GOAL, msgspec.structs.replace(STRIKE, **fields))


def step_into(stack: Stack, reply: m.GoalReply, tenth: int) -> None:
    """Step to `tenth` tenths of the way from a motion's start to its hit, plus 2 ticks."""
    stack.step_to(round((reply.start_time + tenth / 10 * reply.duration) * 1000) + 2)


@TENTHS
def test_a_goal_takes_over_at_any_time(stack: Stack, tenth: int):
    """No quantity jumps at the splice; the replaced goal is preempted, or succeeded if it had already hit."""
    first = strike(stack)
    step_into(stack, first, tenth)
    second = stack.goal(primitive="forehand", positions=HOME, duration=0.7)
    assert round(second.start_time * 1000) == stack.tick + 20
    before = samples_of(stack.plan_of(first))
    result = stack.finish(second)
    assert result.outcome == "succeeded"
    begun = second.start_time < first.start_time + first.duration
    assert stack.result(first.goal_id).outcome == ("preempted" if begun else "succeeded")
    assert (stack.result(first.goal_id).hit is None) == begun
    reference = Reference(stack.commands())
    reference.check_smooth()
    reference.check_limits()
    start, splice = round(first.start_time * 1000), round(second.start_time * 1000)
    kept = reference.positions[start : splice + 1]
    assert np.abs(kept - before.positions[: len(kept)]).max() < 1e-6
    assert np.abs(reference.positions[stack.end_tick(second)] - HOME).max() < 1e-9


@TENTHS
def test_a_cancel_stops_at_any_time(stack: Stack, tenth: int):
    """The stop begins at the first tick from which a stop keeps all limits, and no later."""
    reply = strike(stack)
    plan = samples_of(stack.plan_of(reply))
    step_into(stack, reply, tenth)
    canceled = stack.cancel()
    assert canceled.goal_id == reply.goal_id
    now = stack.tick - round(reply.start_time * 1000)
    stack.step_to(round(canceled.stop_time * 1000) + 2)
    result = stack.result(reply.goal_id)
    assert result.outcome == "canceled"
    assert stack.status().mode == "holding"
    assert stack.status().goal_id is None
    reference = Reference(stack.commands())
    reference.check_smooth()
    reference.check_limits()
    assert not reference.velocities[round(canceled.stop_time * 1000)].any()
    assert reference.velocities[round(canceled.stop_time * 1000) - 1].any()
    played = reference.positions[round(reply.start_time * 1000) :]
    length = min(len(played), len(plan))
    left = np.flatnonzero(np.abs(played[:length] - plan.positions[:length]).max(axis=1) > 0)
    coming = Samples(*(values[now + 1 :] for values in (plan.positions, plan.velocities, plan.accelerations)))
    stop = first_stop(coming, ROBOT.limits)
    assert stop is not None
    assert left.size == 0 or left[0] == now + 1 + stop + 1
    hit = round(reply.duration * 1000)
    assert (result.hit is not None) == (hit <= now + 1 + stop)


def test_a_cancel_before_the_start_moves_nothing(stack: Stack):
    """An accepted goal that has not begun is canceled, and the arm does not move."""
    reply = strike(stack)
    canceled = stack.cancel(reply.goal_id)
    assert canceled.goal_id == reply.goal_id
    stack.step(100)
    assert stack.result(reply.goal_id).outcome == "canceled"
    assert not Reference(stack.commands()).velocities.any()


def trajectory_of(stack: Stack, **fields: object) -> m.Trajectory:
    """Plan the strike and return its trajectory, which can be sent to `execute`."""
    planned = strike(stack, plan_only=True, include_trajectory=True, **fields)
    assert planned.trajectory is not None
    return planned.trajectory


def execute(stack: Stack, trajectory: m.Trajectory, **fields: object) -> m.Accepted:
    """Send a trajectory to the controller."""
    return stack.bus.ask(topics.EXECUTE, msgspec.structs.replace(trajectory, **fields))


def refused(stack: Stack, trajectory: m.Trajectory, **fields: object) -> Refusal:
    """Send a trajectory that the controller must refuse, and return the refusal."""
    with pytest.raises(Refusal) as caught:
        execute(stack, trajectory, **fields)
    return caught.value


def epoch(stack: Stack) -> int:
    """Return the controller's epoch."""
    return stack.bus.ask(topics.REFERENCE, m.ReferenceRequest(lead=0.0)).epoch


def test_refused_goals_leave_the_motion_bit_identical(stack: Stack):
    """A run with refused goals at every tenth has the same states as a run without."""
    trajectory = trajectory_of(stack)
    seed = stack.run + 1
    runs = []
    for disturbing in (False, True):
        stack.reset(seed=seed)
        execute(stack, trajectory, epoch=epoch(stack), goal_id=f"identical {disturbing}")
        for tenth in range(11):
            stack.step_to(20 + 100 * tenth)
            if disturbing:
                assert stack.refused_goal(primitive="forehand", positions=[9.0] * 6).code == "limit"
                assert stack.refused_goal(primitive="lob", positions=HOME).code == "unknown_primitive"
                assert stack.refused_goal(primitive="forehand", positions=HOME, preempt=False).code == "busy"
                assert refused(stack, trajectory, epoch=0).code in ("late", "superseded")
        stack.step_to(1500)
        runs.append(stack.state_bodies())
    assert runs[0] == runs[1]


def test_a_plan_in_flight_when_canceled_is_superseded(stack: Stack):
    """A plan of an earlier epoch is refused, after a cancel or after another plan; nothing moves."""
    trajectory = trajectory_of(stack)
    stack.cancel()
    refusal = refused(stack, trajectory)
    assert (refusal.code, refusal.detail["goal_id"]) == ("superseded", trajectory.goal_id)
    stack.step(100)
    assert not Reference(stack.commands()).velocities.any()
    fresh = trajectory_of(stack)
    execute(stack, fresh)
    assert refused(stack, fresh, goal_id="overtaken").code == "superseded"


def test_a_plan_that_misses_its_instant_is_late(stack: Stack):
    """A plan whose first tick has passed is refused."""
    trajectory = trajectory_of(stack)
    stack.step(20)
    refusal = refused(stack, trajectory)
    assert (refusal.code, refusal.detail["goal_id"]) == ("late", trajectory.goal_id)


def test_a_plan_that_would_jump_is_refused(stack: Stack):
    """The first sample must equal the reference at that time."""
    planned = strike(stack, plan_only=True, include_trajectory=True, start=m.Start(positions=[0.1, *HOME[1:]]))
    assert planned.trajectory is not None
    refusal = refused(stack, planned.trajectory)
    assert (refusal.code, refusal.detail["field"]) == ("invalid_goal", "positions")
    assert "joint_1" in refusal.message


def test_the_same_goal_twice_is_played_once(stack: Stack):
    """A repeated goal gets the same reply. The same id with another body, or sent to the controller, is a duplicate."""
    body = {"primitive": "forehand", "positions": HOME, "duration": 0.5, "goal_id": "once"}
    first = stack.goal(**body)
    assert stack.goal(**body) == first
    stack.finish(first)
    assert stack.goal(**body) == first
    stack.step(100)
    assert stack.status().mode == "holding"
    refusal = stack.refused_goal(**{**body, "duration": 0.6})
    assert (refusal.code, refusal.detail["goal_id"]) == ("duplicate", "once")
    refusal = refused(stack, trajectory_of(stack), goal_id="once", epoch=epoch(stack))
    assert (refusal.code, refusal.detail["goal_id"]) == ("duplicate", "once")


def test_a_goal_that_does_not_preempt_is_busy(stack: Stack):
    """It is refused as `busy`, naming the running goal, until that goal has ended."""
    first = strike(stack)
    step_into(stack, first, 5)
    refusal = stack.refused_goal(primitive="forehand", positions=HOME, preempt=False)
    assert (refusal.code, refusal.detail["goal_id"]) == ("busy", first.goal_id)
    assert stack.finish(first).outcome == "succeeded"
    second = stack.goal(primitive="forehand", positions=HOME, preempt=False)
    assert stack.finish(second).outcome == "succeeded"


def hold(client: Bus, name: str) -> None:
    """Declare a client's token and wait until the router knows it: the goal is sent by another session."""
    client.announce(f"client/{name}")
    assert client.is_alive(f"client/{name}")


def test_a_lease_keeps_others_out_and_ends_with_its_client(stack: Stack):
    """Goals of others are refused as `not_holder`; when the holder's session closes, the motion is canceled."""
    with Bus(open_session([stack.endpoint])) as client:
        hold(client, "alice")
        first = strike(stack, client_id="alice", lease=True)
        step_into(stack, first, 2)
        refusal = stack.refused_goal(primitive="forehand", positions=HOME, client_id="bob")
        assert (refusal.code, refusal.detail["client_id"]) == ("not_holder", "alice")
        assert stack.refused_goal(primitive="forehand", positions=HOME).code == "not_holder"
        second = strike(stack, client_id="alice", lease=True)
        step_into(stack, second, 2)
        assert stack.status().mode == "tracking"
    wait_for(lambda: stack.status().mode == "stopping", "the controller to detect that the client is gone")
    stack.step(300)
    result = stack.result(second.goal_id)
    assert result.outcome == "canceled"
    assert "alice" in result.reason
    assert stack.result(first.goal_id).outcome == "preempted"
    Reference(stack.commands()).check_smooth()
    third = stack.goal(primitive="forehand", positions=HOME, client_id="bob")
    assert stack.finish(third).outcome == "succeeded"


def test_a_lease_needs_a_client_that_lives(stack: Stack):
    """A client without a token gets no lease, because nothing would ever end it."""
    refusal = stack.refused_goal(primitive="forehand", positions=HOME, client_id="ghost", lease=True)
    assert (refusal.code, refusal.detail["client_id"]) == ("not_holder", "ghost")
    stack.step(100)
    assert not Reference(stack.commands()).velocities.any()


def test_anyone_may_cancel_a_leased_motion(stack: Stack):
    """A cancel needs no lease."""
    with Bus(open_session([stack.endpoint])) as client:
        hold(client, "carol")
        reply = strike(stack, client_id="carol", lease=True)
        step_into(stack, reply, 3)
        assert stack.cancel(reply.goal_id).goal_id == reply.goal_id


# --- goals of every kind ----------------------------------------------------------------------------------


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
