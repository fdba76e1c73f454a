"""Goals for a movement of all joints, and the requests or refusals that become of them."""

import numpy as np
import pytest

from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest
from protocol import messages as m
from protocol.errors import Refusal
from robot.description import load_robot
from services.planner.goal_checks import check_goal
from services.planner.goals import Origin, motion_request

ROBOT = load_robot()
JOINTS = ROBOT.joint_count
HOME = ROBOT.home.tolist()
REST = np.zeros(JOINTS)
ORIGIN = Origin(2.0, 7, Boundary(ROBOT.home, REST, REST))
FREE = [None] * (JOINTS - 1)


def goal(**fields: object) -> m.Goal:
    """Return a goal at home with changed `fields`."""
    return m.Goal(**{"primitive": "swing", "positions": HOME, **fields})  # type: ignore[arg-type]


def requested(primitive: Primitive, **fields: object) -> MotionRequest:
    """Check a goal, and return its motion request."""
    asked = goal(**fields)
    check_goal(asked, primitive, ROBOT)
    return motion_request(asked, primitive, ROBOT, ORIGIN)


def refused(primitive: Primitive, **fields: object) -> Refusal:
    """Return the refusal that a goal must get."""
    with pytest.raises(Refusal) as caught:
        requested(primitive, **fields)
    return caught.value
