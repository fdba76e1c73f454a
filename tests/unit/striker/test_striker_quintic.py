"""Swings planned by the striker itself, with its own collision check."""

import numpy as np
import pytest

from protocol import messages as m
from protocol.errors import Refusal
from robot.description import load_robot
from robot.motion_check import MotionCheck
from services.striker.quintic import quintic_message

ROBOT = load_robot()
HOME, STILL = ROBOT.home.tolist(), [0.0] * ROBOT.joint_count
REFERENCE = m.Reference(time=4.0, epoch=3, positions=HOME, velocities=STILL, accelerations=STILL)


def swing(moved: float) -> m.Trajectory:
    """Plan a swing whose second joint ends `moved` rad from home."""
    end = (ROBOT.home + moved * np.eye(ROBOT.joint_count)[1]).tolist()
    goal = m.Goal(primitive="forehand", positions=end, velocities=STILL, arrival_time=4.8, goal_id="g1")
    return quintic_message(goal, REFERENCE, ROBOT, MotionCheck(ROBOT), 0)


def test_a_swing_into_the_floor_is_refused():
    assert swing(0.4).count > 800
    with pytest.raises(Refusal) as caught:
        swing(1.2)
    assert (caught.value.code, caught.value.detail["body"], caught.value.detail["other"]) == (
        "collision",
        "racket",
        "floor",
    )
