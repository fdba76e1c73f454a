"""Motions without a demonstration, for comparison: one polynomial of degree 5 to the goal."""

import numpy as np

from motion.errors import MotionError
from motion.program.ending import ending
from motion.request import Boundary, MotionRequest
from motion.trajectory import Trajectory, quintic


def plan_quintic(request: MotionRequest) -> Trajectory:
    """Return the polynomial from start to goal with zero accelerations at both, then follow-through and stop.

    Of the request it uses start, goal, duration, limits and follow_through. The polynomial may exceed the limits: check
    it.

    Raises:
        MotionError: the arm cannot stop inside its position and velocity limits.
    """
    goal = Boundary(request.goal.positions, request.goal.velocities, np.zeros(request.joint_count))
    coefficients = quintic(request.start.state, goal.state, request.duration)
    end = ending(request, goal)
    if end.cannot_stop().size:
        raise MotionError("the arm cannot stop inside its limits after this goal")
    return Trajectory(np.array([0.0, request.duration]), coefficients[None]).then(end.trajectory())
