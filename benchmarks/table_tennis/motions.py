"""Motions from a state of the arm to a hit, by the planner and by the methods for comparison."""

import numpy as np

from benchmarks.table_tennis.checks import violations
from benchmarks.table_tennis.played import Motion
from benchmarks.table_tennis.variants import Method
from motion.dmp_plan import plan_dmp
from motion.errors import MotionError
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.quintic_plan import plan_quintic
from motion.request import Boundary, MotionRequest
from motion.sampled import check_limits
from robot.striking.choice import Choice, State
from robot.striking.options import Options

TICK_S = 0.001


def make_motion(
    method: Method,
    primitive: Primitive,
    limits: Limits,
    state: State,
    choice: Choice,
    phase: float,
    follow_through: float = Options().follow_through,
) -> Motion | None:
    """Return the motion from `state` to a hit, None if the method refuses it or exceeds the limits.

    follow_through: s after the middle of the contact for which the velocities of the hit are kept.
    """
    duration = choice.goal_time - state.time
    start = Boundary(state.positions, state.velocities, state.accelerations)
    goal = Boundary(choice.positions, choice.velocities, np.full(len(choice.positions), np.nan))
    try:
        if method == "quintic":
            trajectory = plan_quintic(MotionRequest(start, goal, duration, limits, follow_through=follow_through))
        elif method == "dmp":
            made = plan_dmp(primitive, MotionRequest(start, goal, duration, limits), TICK_S)
            check_limits(made)
            trajectory = made.trajectory
        else:
            request = MotionRequest(start, goal, duration, limits, follow_through=follow_through, phase=phase)
            trajectory = plan(primitive, request, TICK_S, remedy=False, thorough=False).trajectory
    except MotionError:
        return None
    motion = Motion(state.time, trajectory, phase, choice.goal_time)
    if method != "qp" and violations(limits, [motion], choice.goal_time + 0.2):
        return None
    return motion
