"""Requests for the demonstrated strike, and for its trajectory."""

import msgspec
import pytest
from harness import ROBOT, Stack

from protocol import messages as m
from protocol import topics
from protocol.errors import Refusal
from tools.demo.strikes import goal

HOME = ROBOT.home.tolist()
STRIKE = goal()


def strike(stack: Stack, **fields: object) -> m.GoalReply:
    """Begin the demonstrated strike."""
    return stack.bus.ask(topics.GOAL, msgspec.structs.replace(STRIKE, **fields))


def step_into(stack: Stack, reply: m.GoalReply, tenth: int) -> None:
    """Step to `tenth` tenths of the way from a motion's start to its hit, plus 2 ticks."""
    stack.step_to(round((reply.start_time + tenth / 10 * reply.duration) * 1000) + 2)


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
