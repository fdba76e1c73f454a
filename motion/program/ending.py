"""What follows the moving part of a motion: a straight part if asked for, and the stop."""

from dataclasses import dataclass

import numpy as np

from motion.braking import TOUCH, Stop, fastest_stop
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
    reach = np.empty((request.joint_count, 4, 2))
    reach[:, 0] = goal.positions[:, None]
    reach[:, 1] = goal.velocities[:, None]
    if request.tail == "coast":
        reach[:, 2:] = np.inf, -np.inf
        return Ending(request, None, reach, np.zeros(0, dtype=int))
    final = np.where(np.isnan(given), reached, given)
    halt = fastest_stop(goal.velocities, final, limits.accelerations, limits.jerks)
    low, high, reach[:, 1, 0], reach[:, 1, 1] = halt.extremes(request.stops_at)
    reach[:, 0, 0], reach[:, 0, 1] = np.minimum(low, goal.positions), np.maximum(high, goal.positions)
    peak, jerk = halt.sign * halt.peak, halt.sign * halt.jerk
    first, last = np.where(halt.bending > 0, -jerk, 0.0), np.where(halt.peak > 0, jerk, 0.0)
    for quantity, ends in ((2, (final, -peak)), (3, (first, last))):
        reach[:, quantity, 0] = np.minimum(np.minimum(*ends), 0.0)
        reach[:, quantity, 1] = np.maximum(np.maximum(*ends), 0.0)
    ranges = limits.ranges
    outside = (reach[:, :2, 0] < ranges[:, :2, 0] - TOUCH) | (reach[:, :2, 1] > ranges[:, :2, 1] + TOUCH)
    return Ending(request, halt, reach, np.flatnonzero(outside.any(axis=1)))


def _straight(request: MotionRequest) -> Trajectory:
    """The part with the final velocity: before the hit for a rest fraction, after it to follow through."""
    goal = request.goal
    line = np.zeros((1, request.joint_count, COEFFICIENTS))
    line[0, :, 0] = goal.positions - request.rest_fraction * request.duration * goal.velocities
    line[0, :, 1] = goal.velocities
    return Trajectory(np.array([0.0, request.straight_duration]), line)
