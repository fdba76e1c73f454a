"""What follows the moving part of a motion: a straight part if asked for, and the stop."""

from typing import NamedTuple

import numpy as np

from motion.braking import TOUCH, fastest_stop
from motion.request import MotionRequest
from motion.trajectory import COEFFICIENTS, Trajectory


class Ending(NamedTuple):
    """What follows the moving part.

    trajectory: from its end on. reach: lowest and highest values in it (J, 4, 2). stuck: joints (n,)
    that leave their limits in it.
    """

    trajectory: Trajectory
    reach: np.ndarray
    stuck: np.ndarray


def ending(request: MotionRequest, reached: np.ndarray) -> Ending:
    """Return what follows a moving part whose last accelerations (J,) are `reached`, where none are given."""
    goal, limits, given = request.goal, request.limits, request.final_accelerations
    end = goal.positions + request.follow_through * goal.velocities
    line = _straight(request)
    reach = np.empty((len(end), 4, 2))
    reach[:, :2, 0] = reach[:, :2, 1] = np.stack([goal.positions, goal.velocities], axis=1)
    reach[:, 2:, 0], reach[:, 2:, 1] = np.inf, -np.inf
    if request.tail == "coast":
        return Ending(line, reach, np.zeros(0, dtype=int))
    final = np.where(np.isnan(given), reached, given)
    halt = fastest_stop(goal.velocities, final, limits.accelerations, limits.jerks)
    low, high, slow, fast = halt.extremes(end)
    motion = halt.trajectory(end)
    accelerations, jerks = 2 * motion.coefficients[..., 2], 6 * motion.coefficients[..., 3]
    reach[:, 0, 0], reach[:, 0, 1] = np.minimum(low, goal.positions), np.maximum(high, goal.positions)
    reach[:, 1, 0], reach[:, 1, 1] = slow, fast
    reach[:, 2, 0], reach[:, 2, 1] = accelerations.min(axis=0), accelerations.max(axis=0)
    reach[:, 3, 0], reach[:, 3, 1] = jerks.min(axis=0), jerks.max(axis=0)
    ranges = limits.ranges
    outside = (reach[:, :2, 0] < ranges[:, :2, 0] - TOUCH) | (reach[:, :2, 1] > ranges[:, :2, 1] + TOUCH)
    behind = line.then(motion) if request.straight_duration else motion
    return Ending(behind, reach, np.flatnonzero(outside.any(axis=1)))


def _straight(request: MotionRequest) -> Trajectory:
    """The part with the final velocity: before the hit for a rest fraction, after it to follow through."""
    goal = request.goal
    line = np.zeros((1, request.joint_count, COEFFICIENTS))
    line[0, :, 0] = goal.positions - request.rest_fraction * request.duration * goal.velocities
    line[0, :, 1] = goal.velocities
    return Trajectory(np.array([0.0, request.straight_duration]), line)
