"""A motion planned with the DMP of eq. 6–7 instead of the quadratic program: nothing keeps its limits."""

import numpy as np

from motion.dmp import BASIS_COUNT, learn_dmp
from motion.errors import InvalidMotion
from motion.primitive import Primitive
from motion.program.report import Distance
from motion.request import MotionRequest
from motion.sampled import SampledPlan, make_plan
from motion.trajectory import Trajectory


def plan_dmp(primitive: Primitive, request: MotionRequest, tick: float = 0.001) -> SampledPlan:
    """Plan with eq. 6–7, learned afresh from the demonstration that `primitive` was learned from.

    The duration is rounded to ticks; accelerations are linear within a tick. A start's acceleration is the first
    sample's; from it the motion jumps to the DMP's own within one tick. The stop begins at the state that was reached,
    which is not exactly the goal. Limits are not looked at but for the stop's jerk and acceleration: see
    `motion.sampled.check_limits`.

    Raises:
        InvalidMotion: what a DMP cannot do is asked for: waypoints, a rest fraction, a given final acceleration, a
            follow-through, a place time, a phase.
    """
    _refuse_what_it_cannot(primitive, request)
    made = learn_dmp(primitive).rollout(request.start, request.goal, request.duration, tick, "newmark")
    jerks, zero = np.diff(made.accelerations, axis=0) / tick, np.zeros((len(made) - 1, request.joint_count))
    powers = made.positions[:-1], made.velocities[:-1], made.accelerations[:-1] / 2, jerks / 6, zero, zero
    moving = Trajectory(np.arange(len(made)) * tick, np.stack(powers, axis=2))
    return make_plan(primitive, request, moving, tick, BASIS_COUNT, Distance(zero[0], zero[0]))


def _refuse_what_it_cannot(primitive: Primitive, request: MotionRequest) -> None:
    primitive.check_joints(request.joint_count)
    remedy = "a DMP has no such thing; leave it out or use method 'qp'"
    if request.waypoints:
        raise InvalidMotion("waypoints", f"has {len(request.waypoints)} entries; {remedy}")
    for field, free in (("rest_fraction", 0.0), ("follow_through", 0.0), ("phase", 0.0), ("place_time", None)):
        value = getattr(request, field)
        if value != free:
            raise InvalidMotion(field, f"is {value}; {remedy}")
    if not np.isnan(request.goal.accelerations).all():
        raise InvalidMotion("goal.accelerations", f"is given; {remedy}")
