"""Motions planned with the DMP of eq. 6–7 instead of the quadratic program. They need not keep the limits."""

import numpy as np

from motion.dmp import BASIS_COUNT, learn_dmp
from motion.errors import InvalidMotion
from motion.primitive import Primitive
from motion.program.report import Distance
from motion.request import MotionRequest
from motion.sampled import SampledPlan, make_plan
from motion.trajectory import Trajectory

LARGEST = 1e6
"""Largest position, velocity or acceleration of a start or goal (rad, s): those of a DMP may exceed the limits."""


def plan_dmp(primitive: Primitive, request: MotionRequest, tick: float = 0.001) -> SampledPlan:
    """Plan with eq. 6–7, learned again from the demonstration of `primitive`.

    The duration is rounded to ticks; accelerations are linear within a tick. The first sample has the start's
    acceleration; the second has the DMP's own, which may be a jump. The stop begins in the state that the DMP reaches,
    which is not exactly the goal. Only the stop keeps limits, those of jerk and acceleration: see
    `motion.sampled.check_limits`.

    Raises:
        InvalidMotion: the request has something that a DMP cannot do: waypoints, a rest fraction, a given final
            acceleration, a follow-through, a place time, a phase, numbers beyond LARGEST.
    """
    _refuse_what_it_cannot(primitive, request)
    made = learn_dmp(primitive).rollout(request.start, request.goal, request.duration, tick, "newmark")
    jerks, zero = np.diff(made.accelerations, axis=0) / tick, np.zeros((len(made) - 1, request.joint_count))
    powers = made.positions[:-1], made.velocities[:-1], made.accelerations[:-1] / 2, jerks / 6, zero, zero
    moving = Trajectory(np.arange(len(made)) * tick, np.stack(powers, axis=2))
    return make_plan(primitive, request, moving, tick, BASIS_COUNT, Distance(zero[0], zero[0]))


def _refuse_what_it_cannot(primitive: Primitive, request: MotionRequest) -> None:
    primitive.check_joints(request.joint_count)
    remedy = "a DMP does not support it; leave it out or use method 'qp'"
    if request.waypoints:
        raise InvalidMotion("waypoints", f"has {len(request.waypoints)} entries; {remedy}")
    for field, free in (("rest_fraction", 0.0), ("follow_through", 0.0), ("phase", 0.0), ("place_time", None)):
        value = getattr(request, field)
        if value != free:
            raise InvalidMotion(field, f"is {value}; {remedy}")
    if not np.isnan(request.goal.accelerations).all():
        raise InvalidMotion("goal.accelerations", f"is given; {remedy}")
    for end in ("start", "goal"):
        for name in ("positions", "velocities", "accelerations"):
            largest = np.abs(np.nan_to_num(getattr(getattr(request, end), name))).max()
            if largest > LARGEST:
                raise InvalidMotion(f"{end}.{name}", f"reaches {largest:g}; it must lie within {LARGEST:g} of 0")
