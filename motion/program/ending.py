"""What follows the moving part of a motion: a straight part if asked for, and the stop."""

from dataclasses import dataclass

import numpy as np

from motion.braking import TOUCH, Stop, fastest_stop
from motion.limits import SIGNS
from motion.request import MotionRequest
from motion.trajectory import COEFFICIENTS, Trajectory


@dataclass(frozen=True, slots=True, eq=False)
class Ending:
    """What follows the moving part.

    halt: the stop, None for an arm that coasts. reach (J, 4, 2): lowest and highest values of all quantities, of the
    acceleration and jerk of an arm that coasts none. stuck: joints (n,) that leave their limits in it.
    """

    request: MotionRequest
    halt: Stop | None
    reach: np.ndarray
    stuck: np.ndarray

    @property
    def duration(self) -> float:
        """From the end of the moving part to rest, s."""
        return self.request.straight_duration + (self.halt.duration if self.halt else 0.0)

    def trajectory(self) -> Trajectory:
        """The motion from the end of the moving part on."""
        line = _straight(self.request)
        if self.halt is None:
            return line
        stop = self.halt.trajectory(self.request.stops_at)
        return line.then(stop) if self.request.straight_duration else stop


def ending(request: MotionRequest, reached: np.ndarray) -> Ending:
    """Return what follows a moving part whose last accelerations (J,) are `reached`, where none are given."""
    goal, limits, given = request.goal, request.limits, request.final_accelerations
    if request.tail == "coast":
        reach = np.full((request.joint_count, 4, 2), (np.inf, -np.inf))
        reach[:, 0], reach[:, 1] = goal.positions[:, None], goal.velocities[:, None]
        return Ending(request, None, reach, np.zeros(0, dtype=int))
    final = np.where(np.isnan(given), reached, given)
    halt = fastest_stop(goal.velocities, final, limits.accelerations, limits.jerks)
    reach = halt.reach(request.stops_at)
    if request.follow_through:
        reach[:, 0, 0] = np.minimum(reach[:, 0, 0], goal.positions)
        reach[:, 0, 1] = np.maximum(reach[:, 0, 1], goal.positions)
    beyond = SIGNS * (reach[:, :2] - limits.ranges[:, :2])
    return Ending(request, halt, reach, np.flatnonzero((beyond > TOUCH).any(axis=(1, 2))))


def _straight(request: MotionRequest) -> Trajectory:
    """The part with the final velocity: before the hit for a rest fraction, after it to follow through."""
    goal = request.goal
    line = np.zeros((1, request.joint_count, COEFFICIENTS))
    line[0, :, 0] = goal.positions - request.rest_fraction * request.duration * goal.velocities
    line[0, :, 1] = goal.velocities
    return Trajectory(np.array([0.0, request.straight_duration]), line)
