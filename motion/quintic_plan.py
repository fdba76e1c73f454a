"""Motions without a demonstration: one polynomial of degree 5 to the goal, for comparison."""

import numpy as np

from motion.errors import MotionError
from motion.program.ending import ending
from motion.request import Boundary, MotionRequest
from motion.trajectory import COEFFICIENTS, Trajectory

ROWS = np.array([[1, 1, 1], [3, 4, 5], [6, 12, 20]], dtype=float)
"""Position, velocity and acceleration at the end of unit time, of the powers 3 to 5."""


def plan_quintic(request: MotionRequest) -> Trajectory:
    """Return the polynomial from start to goal, where accelerations are zero, then follow-through and stop.

    Uses start, goal, duration, limits and follow_through of the request. The polynomial may leave the limits; check it.

    Raises:
        MotionError: the arm cannot stop inside the limits of its positions and velocities.
    """
    start, goal, t = request.start, request.goal, request.duration
    low = np.stack([start.positions, t * start.velocities, t * t * start.accelerations / 2])
    left = np.stack([goal.positions - low.sum(axis=0), t * goal.velocities - low[1] - 2 * low[2], -2 * low[2]])
    powers = np.concatenate([low, np.linalg.solve(ROWS, left)]) / t ** np.arange(COEFFICIENTS)[:, None]
    moving = Trajectory(np.array([0.0, t]), powers.T[None])
    end = ending(request, Boundary(goal.positions, goal.velocities, np.zeros(request.joint_count)))
    if end.stuck().size:
        raise MotionError("the arm cannot stop inside its limits after this goal")
    return moving.then(end.trajectory())
