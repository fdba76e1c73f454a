"""Goals for a moving target, replanned while the arm swings."""

import numpy as np
from harness import ROBOT, Reference, Stack

from deploy.demonstrations.make_forehand import HIT, HIT_VELOCITIES

EVERY = 20  # ticks between goals
GOALS = 45  # the target then stops at the ball; the time left is that of the whole demonstration
DRIFT = np.array([0.004, -0.002, 0.002, 0.002, 0.001, -0.002])  # rad from one goal to the next


def test_a_moving_target_is_followed_and_hit(stack: Stack):
    """Every goal is spliced into the last one without a step, and the arm meets the last target at the given time."""
    hit, replies = 1.8, []
    for left in reversed(range(GOALS)):
        target = np.array(HIT) - left * DRIFT
        replies.append(
            stack.goal(
                primitive="forehand", positions=target.tolist(), velocities=list(HIT_VELOCITIES), arrival_time=hit
            )
        )
        stack.step(EVERY)
    assert all(reply.report.certified for reply in replies)
    result = stack.finish(replies[-1])
    assert result.outcome == "succeeded"
    assert result.hit is not None
    assert np.abs(result.hit.position_error).max() < 5e-3
    outcomes = [stack.result(reply.goal_id).outcome for reply in replies[:-1]]
    assert set(outcomes) == {"preempted"}
    reference = Reference(stack.commands())
    reference.check_smooth()
    reference.check_limits()
    at = round(hit * 1000)
    assert np.abs(reference.positions[at] - HIT).max() < 1e-9
    assert np.abs(reference.velocities[at] - HIT_VELOCITIES).max() < 1e-8
    for reply in replies:
        splice = round(reply.start_time * ROBOT.rate_hz)
        steps = np.abs(np.diff(reference.accelerations[splice - 2 : splice + 3], axis=0))
        assert np.all(steps <= ROBOT.limits.jerks * ROBOT.tick * (1 + 1e-3))
