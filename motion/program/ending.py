"""The ending of a motion, after its moving part: a straight part if requested, and the stop."""

from dataclasses import dataclass

import numpy as np

from motion.braking import STOP_ROUNDING, Floats, fastest_stop
from motion.limits import SIGNS
from motion.request import Boundary, MotionRequest
from motion.trajectory import COEFFICIENTS, Trajectory


@dataclass(frozen=True, slots=True, eq=False)
class Ending:
    """The ending of a motion, from the state `arrival` at the end of the moving part.

    stops_at (J,): positions at which the stop begins, rad. duration: from the end of the moving part to rest, s. reach
    (J, 4, 2): lowest and highest value of each quantity; none of acceleration and jerk with the tail "coast".
    """

    request: MotionRequest
    arrival: Boundary
    stops_at: np.ndarray
    duration: float
    reach: np.ndarray

    def cannot_stop(self) -> np.ndarray:
        """Joints (n,) that exceed their position or velocity limits."""
        if self.request.tail == "coast":
            return np.zeros(0, dtype=int)
        beyond = SIGNS * (self.reach[:, :2] - self.request.limits.ranges[:, :2])
        return np.flatnonzero((beyond > STOP_ROUNDING).any(axis=(1, 2)))

    def trajectory(self) -> Trajectory:
        """The motion from the end of the moving part."""
        request, arrival, limits = self.request, self.arrival, self.request.limits
        line = np.zeros((1, request.joint_count, COEFFICIENTS))
        line[0, :, 0], line[0, :, 1] = arrival.positions, arrival.velocities
        straight = Trajectory(np.array([0.0, request.straight_duration]), line)
        if request.tail == "coast":
            return straight
        stop = fastest_stop(arrival.velocities, arrival.accelerations, limits.accelerations, limits.jerks)
        stopping = stop.trajectory(self.stops_at)
        return straight.then(stopping) if request.straight_duration else stopping


def ending(request: MotionRequest, arrival: Boundary) -> Ending:
    """Return the ending after a moving part that ends in the state `arrival`; a straight part has no acceleration."""
    straight, limits, longest = request.straight_duration, request.limits, 0.0
    if straight:
        arrival = Boundary(arrival.positions, arrival.velocities, np.zeros(request.joint_count))
    stops_at = arrival.positions + straight * arrival.velocities
    if request.tail == "coast":
        reach = np.full((request.joint_count, 4, 2), (np.inf, -np.inf))
        reach[:, 0], reach[:, 1] = stops_at[:, None], arrival.velocities[:, None]
    else:
        states = stops_at, arrival.velocities, arrival.accelerations, limits.accelerations, limits.jerks
        reached = []
        for position, *state in zip(*(values.tolist() for values in states), strict=True):
            stop = fastest_stop(*state, xp=Floats)
            longest = max(longest, stop.duration)
            reached.append(stop.reach(position, Floats))
        reach = np.array(reached).transpose(0, 2, 1)
    if straight:
        reach[:, 0, 0] = np.minimum(reach[:, 0, 0], arrival.positions)
        reach[:, 0, 1] = np.maximum(reach[:, 0, 1], arrival.positions)
    return Ending(request, arrival, stops_at, straight + longest, reach)
