"""Where and when a motion ends: alternatives, the fastest end, following through."""

import numpy as np
import pytest
from harness import ROBOT, Reference, Stack, check_end

from deploy.demonstrations.make_forehand import HIT, HIT_VELOCITIES
from protocol import messages as m

FAR = [2.1, *HIT[1:]]
"""A position inside the limits that leaves room to stop only after slow arrivals."""


def end(move: float = 0.0, **fields: object) -> m.Alternative:
    """Return an end whose joints are all `move` rad beside the hit."""
    return m.Alternative(positions=[place + move for place in HIT], **fields)  # type: ignore[arg-type]


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


def test_without_positions_the_primitive_ends_where_it_was_shown(stack: Stack):
    """A goal without positions ends at the demonstrated position and velocity; given velocities are met instead."""
    reply = stack.goal(positions=None)
    assert np.abs(np.array(reply.positions) - HIT).max() < 1e-4
    assert np.abs(np.array(reply.velocities) - HIT_VELOCITIES).max() < 1e-2
    check_end(stack, reply)
    slow = stack.goal(positions=None, velocities=[0.5] * 6, plan_only=True)
    assert (slow.positions, slow.velocities) == (reply.positions, [0.5] * 6)
