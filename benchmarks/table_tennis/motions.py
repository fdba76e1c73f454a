"""Motions from one state of the arm to a hit, by the planner and by what it is compared with."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from motion.dmp_plan import plan_dmp
from motion.errors import MotionError
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.program.ending import ending
from motion.request import Boundary, MotionRequest
from motion.sampled import check_limits
from motion.trajectory import COEFFICIENTS, Trajectory
from robot.striking.choice import Choice, State

Method = Literal["qp", "dmp", "quintic"]
AFTER_S = 0.015
"""The velocity of the hit is kept so long after the middle of the contact."""
TICK_S = 0.001
CHECK_HZ = 10_000


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """What is played from `start` (s) on: phase is where in the demonstration it began, hit when it is over (s)."""

    start: float
    trajectory: Trajectory
    phase: float
    hit: float

    def phase_at(self, time: float) -> float:
        """Return where in the demonstration the motion is."""
        return self.phase + (1 - self.phase) * min((time - self.start) / (self.hit - self.start), 0.999)

    def state(self, time: float) -> State:
        """Return the arm's reference at a time."""
        samples = self.trajectory.sample(np.array([time - self.start]))
        return State(time, samples.positions[0], samples.velocities[0], samples.accelerations[0])


def make_motion(
    method: Method, primitive: Primitive, limits: Limits, state: State, choice: Choice, phase: float
) -> Motion | None:
    """Return the motion from `state` to a hit, None where the method refuses it or does not keep the limits."""
    duration = choice.goal_time - state.time
    start = Boundary(state.positions, state.velocities, state.accelerations)
    goal = Boundary(choice.positions, choice.velocities, np.full(len(choice.positions), np.nan))
    try:
        if method == "quintic":
            trajectory = _quintic(start, goal, duration, limits)
        elif method == "dmp":
            made = plan_dmp(primitive, MotionRequest(start, goal, duration, limits), TICK_S)
            check_limits(made)
            trajectory = made.trajectory
        else:
            request = MotionRequest(start, goal, duration, limits, follow_through=AFTER_S, phase=phase)
            trajectory = plan(primitive, request, TICK_S, remedy=False, thorough=False).trajectory
    except MotionError:
        return None
    motion = Motion(state.time, trajectory, phase, choice.goal_time)
    if method != "qp" and violations(limits, [motion], choice.goal_time + 0.2):
        return None
    return motion


def _quintic(start: Boundary, goal: Boundary, duration: float, limits: Limits) -> Trajectory:
    """Return the polynomial of degree 5 between two states, then a stop."""
    t = duration
    rows = np.array([[1, 1, 1], [3, 4, 5], [6, 12, 20]], dtype=float)
    low = np.stack([start.positions, t * start.velocities, t * t * start.accelerations / 2])
    value = np.stack(
        [
            goal.positions - low.sum(axis=0),
            t * goal.velocities - low[1] - 2 * low[2],
            -2 * low[2],
        ]
    )
    found = np.concatenate([low, np.linalg.solve(rows, value)]) / t ** np.arange(COEFFICIENTS)[:, None]
    moving = Trajectory(np.array([0.0, t]), found.T[None])
    nothing = np.zeros(len(goal.positions))
    request = MotionRequest(start, goal, t, limits, follow_through=AFTER_S)
    end = ending(request, Boundary(goal.positions, goal.velocities, nothing))
    stuck = end.stuck()
    if stuck.size:
        raise MotionError("the stop leaves the limits")
    return moving.then(end.trajectory())


def violations(limits: Limits, motions: list[Motion], until: float) -> int:
    """Return at how many of 10,000 instants a second what was played passes a limit, on any joint, and seams jump.

    Nothing of the planner's is used: the pieces' powers are evaluated here, derivatives are those of the powers.
    """
    count = 0
    last: np.ndarray | None = None
    bounds = [limits.positions[:, 1], limits.velocities, limits.accelerations, limits.jerks]
    for k, motion in enumerate(motions):
        end = motions[k + 1].start if k + 1 < len(motions) else until
        times = np.arange(motion.start, end, 1 / CHECK_HZ) - motion.start
        values = _powers(motion.trajectory, times)
        low = limits.positions[:, 0]
        wrong = (values[0] < low - 1e-6) | (values[0] > bounds[0] + 1e-6)
        for order in (1, 2, 3):
            wrong |= np.abs(values[order]) > bounds[order] * (1 + 1e-6)
        count += int(wrong.any(axis=1).sum())
        if last is not None:
            count += int(np.abs(values[:3, 0] - last).max() > 1e-6)
        last = _powers(motion.trajectory, np.array([end - motion.start]))[:3, 0]
    return count


def _powers(trajectory: Trajectory, times: np.ndarray) -> np.ndarray:
    """Return position, velocity, acceleration and jerk, (4, n, J)."""
    piece = np.clip(np.searchsorted(trajectory.breaks, times, side="right") - 1, 0, len(trajectory.coefficients) - 1)
    x = (times - trajectory.breaks[piece])[:, None]
    coefficients = trajectory.coefficients[piece]
    found = []
    for order in range(4):
        total = np.zeros(coefficients.shape[:2])
        for power in range(order, COEFFICIENTS):
            factor = np.prod(np.arange(power - order + 1, power + 1), dtype=float)
            total += factor * coefficients[:, :, power] * x ** (power - order)
        found.append(total)
    return np.array(found)
