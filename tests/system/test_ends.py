"""Where and when a motion ends, over the wire: alternatives, the fastest motion, follow-through, places, rounding."""

import numpy as np
import pytest
from harness import ROBOT, Reference, Stack

from deploy.demonstrations.make_forehand import FOREHAND, HIT, HIT_VELOCITIES
from motion.demonstration import Demonstration
from motion.primitive import Primitive, learn
from protocol import messages as m
from robot.conversions import samples_of
from tools.demo.strikes import FASTER, TIGHT

LIMITS = ROBOT.limits.positions
HOME = ROBOT.home.tolist()
FAR = [2.1, *HIT[1:]]
"""A position inside the limits that leaves room to stop only after slow arrivals."""


def end(move: float = 0.0, **fields: object) -> m.Alternative:
    """Return an end whose joints are all `move` rad beside the hit."""
    return m.Alternative(positions=[place + move for place in HIT], **fields)  # type: ignore[arg-type]


def taught() -> Primitive:
    """Return the forehand as the planner has learned it."""
    recorded = np.loadtxt(FOREHAND, delimiter=",", skiprows=1)
    return learn(Demonstration(recorded[:, 0], recorded[:, 1:]))


def check_end(stack: Stack, reply: m.GoalReply) -> None:
    """Check that the motion is played smoothly, inside the limits, to the end that the reply names."""
    assert stack.finish(reply).outcome == "succeeded"
    played = Reference(stack.commands())
    played.check_smooth()
    played.check_limits()
    at = stack.ticks(reply.start_time + reply.duration)
    assert np.abs(played.positions[at] - reply.positions).max() < 1e-9
    assert np.abs(played.velocities[at] - reply.velocities).max() < 1e-8


# --- alternatives -----------------------------------------------------------------------------------------


def test_the_best_alternative_is_played(stack: Stack):
    """Each alternative may have its own duration; fields that it leaves out are taken from the goal."""
    alternatives = [end(0.1, duration=1.0), end(0.02, duration=1.0), end(0.05, duration=1.0), end(duration=0.02)]
    reply = stack.strike(duration=0.03, alternatives=alternatives)
    assert reply.alternative == 2
    assert (reply.duration, reply.velocities) == (1.0, list(HIT_VELOCITIES))
    assert reply.positions == alternatives[1].positions
    check_end(stack, reply)


def test_the_goals_own_end_is_played_if_it_is_the_best(stack: Stack):
    """The reply is the same as without alternatives."""
    alone = stack.strike(plan_only=True)
    reply = stack.strike(alternatives=[end(0.1), end(-0.1), m.Alternative(duration=0.7)])
    assert reply.alternative == 0
    assert (reply.positions, reply.duration) == (alone.positions, alone.duration)
    assert reply.report.imitation_rms == pytest.approx(alone.report.imitation_rms, abs=1e-6)
    check_end(stack, reply)


def test_an_end_with_an_arrival_time(stack: Stack):
    """The arrival time of an alternative is on the robot's clock, like the goal's."""
    stack.step(100)
    reply = stack.strike(duration=0.03, alternatives=[m.Alternative(arrival_time=1.2)])
    assert reply.alternative == 1
    assert reply.start_time + reply.duration == pytest.approx(1.2, abs=1e-9)
    check_end(stack, reply)


def test_a_correction_with_alternatives(stack: Stack):
    """A correction imitates the rest of the demonstration to the best alternative."""
    first = stack.strike()
    stack.step_to(stack.ticks(first.start_time) + 480)
    reply = stack.strike(revises=first.goal_id, positions=FAR, alternatives=[end(0.1), end(0.02), end(-0.05)])
    assert reply.alternative == 2
    assert reply.report.phase == pytest.approx(0.5, abs=1e-9)
    assert reply.start_time + reply.duration == pytest.approx(first.start_time + first.duration, abs=1e-9)
    check_end(stack, reply)


def test_the_most_alternatives(stack: Stack):
    """A goal may have 256 alternatives; here the last one is the nearest and is played."""
    ends = [end(0.15 - 0.0005 * k) for k in range(256)]
    reply = stack.strike(positions=FAR, alternatives=ends)
    assert reply.alternative == 256
    check_end(stack, reply)


def test_if_all_ends_are_refused_each_code_is_reported(stack: Stack):
    """The refusal is the goal's own; its detail lists the codes of the alternatives in their order."""
    beyond = [9.0, *HIT[1:]]
    fast = [12.0, *HIT_VELOCITIES[1:]]
    alternatives = [
        m.Alternative(positions=beyond),
        m.Alternative(positions=FAR, velocities=fast, duration=1.0),
        m.Alternative(duration=0.05),
    ]
    alone = stack.refused_goal(positions=list(HIT), velocities=list(HIT_VELOCITIES), duration=0.03)
    refusal = stack.refused_goal(
        positions=list(HIT), velocities=list(HIT_VELOCITIES), duration=0.03, alternatives=alternatives
    )
    assert refusal.code == alone.code == "infeasible"
    limit, cannot_stop, hopeless = refusal.detail["alternatives"]
    assert (limit, cannot_stop) == ("limit", "cannot_stop")
    assert hopeless in (
        "infeasible",
        "solver_failed",
    )  # with other ends to try, the planner may give up before it has a proof
    assert {name: refusal.detail[name] for name in ("joint", "quantity")} == {
        name: alone.detail[name] for name in ("joint", "quantity")
    }
    stack.step(50)
    assert not Reference(stack.commands()).velocities.any()


@pytest.mark.parametrize(
    ("code", "field", "more"),
    [
        ("invalid_goal", "alternatives", {"alternatives": [end()] * 257}),
        ("bad_message", "alternatives[1].positions", {"alternatives": [end(), m.Alternative(positions=[0.0] * 5)]}),
        ("bad_message", "alternatives[0].velocities", {"alternatives": [m.Alternative(velocities=[0.0] * 7)]}),
        ("bad_message", "alternatives[0].accelerations", {"alternatives": [m.Alternative(accelerations=[])]}),
        ("invalid_goal", "alternatives[0].arrival_time", {"alternatives": [end(duration=1.0, arrival_time=1.0)]}),
        ("invalid_goal", "alternatives[0].duration", {"alternatives": [end(duration=0.0)]}),
        ("invalid_goal", "alternatives", {"alternatives": [end()], "method": "gaussian"}),
        ("invalid_goal", "fastest", {"fastest": True, "duration": 1.0}),
        ("invalid_goal", "fastest", {"fastest": True, "arrival_time": 1.0}),
        ("invalid_goal", "fastest", {"fastest": True, "alternatives": [end()]}),
        ("invalid_goal", "fastest", {"fastest": True, "method": "dmp"}),
        ("invalid_goal", "follow_through", {"follow_through": 0.6}),
        ("invalid_goal", "follow_through", {"follow_through": -0.1}),
        ("invalid_goal", "follow_through", {"follow_through": 0.1, "tail": "coast", "plan_only": True}),
        ("invalid_goal", "accelerations", {"follow_through": 0.1, "accelerations": [1.0] * 6}),
        ("invalid_goal", "place_time", {"place_time": 0.0}),
        ("invalid_goal", "place_time", {"place_time": -1.0}),
        ("invalid_goal", "place_time", {"place_time": 0.5, "method": "gaussian"}),
    ],
)
def test_contradicting_fields_are_refused(stack: Stack, code: str, field: str, more: dict):
    """The refusal names the field, and nothing moves."""
    refusal = stack.refused_goal(**more)
    assert (refusal.code, refusal.detail["field"]) == (code, field)
    stack.step(20)
    assert not Reference(stack.commands()).velocities.any()


# --- the fastest ------------------------------------------------------------------------------------------


def test_the_fastest_motion(stack: Stack):
    """A quarter of its duration is infeasible, and the refusal offers no duration that is much shorter."""
    reply = stack.strike(fastest=True)
    assert reply.duration < 0.6
    quarter = round(reply.duration / 4, 3)
    refusal = stack.refused_goal(positions=list(HIT), velocities=list(HIT_VELOCITIES), duration=quarter)
    assert refusal.code == "infeasible"
    assert refusal.detail["min_duration"] > 0.9 * reply.duration
    check_end(stack, reply)


def test_the_fastest_correction(stack: Stack):
    """`fastest` with `revises` plays the rest of the demonstration as fast as possible."""
    first = stack.strike()
    stack.step_to(stack.ticks(first.start_time) + 480)
    reply = stack.strike(revises=first.goal_id, fastest=True)
    assert reply.report.phase == pytest.approx(0.5, abs=1e-9)
    assert reply.duration < 0.5
    check_end(stack, reply)


# --- following through ------------------------------------------------------------------------------------


@pytest.mark.parametrize("seconds", [0.03, 0.1])
def test_following_through_keeps_the_velocity(stack: Stack, seconds: float):
    """From the hit on the velocity is constant for the follow-through; then the arm stops."""
    reply = stack.strike(follow_through=seconds)
    check_end(stack, reply)
    played, at = Reference(stack.commands()), stack.ticks(reply.start_time + reply.duration)
    straight = slice(at, at + round(seconds * ROBOT.rate_hz) + 1)
    assert np.abs(played.velocities[straight] - HIT_VELOCITIES).max() < 1e-8
    assert np.abs(played.velocities[straight.stop + 2] - HIT_VELOCITIES).max() > 1e-3
    end_position = HIT + seconds * np.array(HIT_VELOCITIES)
    assert np.abs(played.positions[straight.stop - 1] - end_position).max() < 1e-8
    assert not played.velocities[stack.end_tick(reply)].any()


def test_following_through_needs_room_to_stop(stack: Stack):
    """A goal may leave room to stop directly after the hit, but not after the follow-through."""
    near = {"positions": [1.9, *HIT[1:]], "velocities": [4.6, *HIT_VELOCITIES[1:]], "duration": 1.0}
    assert stack.goal(**near, plan_only=True).report.certified
    refusal = stack.refused_goal(**near, follow_through=0.1)
    assert (refusal.code, refusal.detail["joint"]) == ("cannot_stop", "joint_1")
    assert 0 < refusal.detail["max_velocity"] < 4.6
    slower = [0.99 * refusal.detail["max_velocity"], *HIT_VELOCITIES[1:]]
    check_end(stack, stack.goal(**{**near, "velocities": slower}, follow_through=0.1))


# --- places, the paper's method, long motions -------------------------------------------------------------


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


def test_without_positions_the_primitive_ends_where_it_was_shown(stack: Stack):
    """A goal without positions ends at the demonstrated position and velocity; given velocities are met instead."""
    reply = stack.goal(positions=None)
    assert np.abs(np.array(reply.positions) - HIT).max() < 1e-4
    assert np.abs(np.array(reply.velocities) - HIT_VELOCITIES).max() < 1e-2
    check_end(stack, reply)
    slow = stack.goal(positions=None, velocities=[0.5] * 6, plan_only=True)
    assert (slow.positions, slow.velocities) == (reply.positions, [0.5] * 6)


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


# --- rounding ---------------------------------------------------------------------------------------------


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
