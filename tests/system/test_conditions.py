"""An arm that does not follow commands, or whose controller was killed in motion, over the wire."""

import numpy as np
from harness import ROBOT, Stack

from protocol import messages as m
from protocol import topics


def test_a_goal_right_after_guide_is_refused(stack: Stack):
    """With the stepped clock no tick passes between the two, at tick 0 or later; `recover` ends it."""
    for ticks in (0, 10):
        stack.reset()
        if ticks:
            stack.step(ticks)
        assert stack.bus.ask(topics.GUIDE, m.Empty()).condition == "guiding"
        refusal = stack.refused_goal()
        assert (refusal.code, refusal.detail["fault"]) == ("fault", "the arm is guided by hand: `guide` was requested")
        assert stack.bus.ask(topics.RECOVER, m.Empty()).condition == "ready"
        assert stack.strike().goal_id


def test_guiding_ends_a_motion_that_has_not_begun(stack: Stack):
    """The arm is at rest until the motion begins, so it may be guided; the motion is aborted at once."""
    first = stack.strike()
    stack.bus.ask(topics.GUIDE, m.Empty())
    assert stack.result(first.goal_id).outcome == "aborted"
    stack.step(100)
    assert not any(any(command.velocities) for command in stack.commands())
    stack.bus.ask(topics.RECOVER, m.Empty())


def test_an_arm_whose_controller_was_killed_in_motion_is_stopped_by_the_next_one(stack: Stack):
    """With the stepped clock no time passes in between, so the arm still moves; it is stopped inside its limits."""
    first = stack.strike()
    stack.step_to(stack.ticks(first.start_time + 0.9 * first.duration))
    before = stack.state()
    assert max(map(abs, before.velocities)) > 1.0
    stack.kill("controller")
    stack.start_again("controller")
    assert stack.mode() == "stopping"
    stack.step(500)
    assert stack.mode() == "holding"
    after = [command for command in stack.commands() if command.tick >= before.tick - 1]  # one of the killed controller
    changes = np.abs(np.diff([command.feedforward for command in after if command.feedforward], axis=0))
    assert np.all(changes <= ROBOT.limits.jerks * ROBOT.tick * (1 + 1e-3))
    accelerations = np.array([command.accelerations for command in after])
    assert np.all(np.abs(accelerations) <= ROBOT.limits.accelerations)
    assert np.abs(stack.state().velocities).max() < 1e-3
    assert stack.finish(stack.goal()).outcome == "succeeded"
