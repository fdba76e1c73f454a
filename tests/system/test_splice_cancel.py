"""Goals that replace a motion or cancel it, at any time."""

import numpy as np
import pytest
from harness import ROBOT, Reference, Stack
from strike_requests import HOME, step_into, strike

from motion.braking import first_stop
from motion.trajectory import Samples
from robot.conversions import samples_of

TENTHS = pytest.mark.parametrize("tenth", [0, 3, 8, 10])
"""Parts of the motion, in tenths; the drill's scenarios `preempt` and `cancel` have all of them."""


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
