"""Planning before anybody asks, so that the first goal finds everything built, loaded and compiled."""

from dataclasses import replace

import numpy as np

from motion.limits import Limits
from motion.plan import Plan, plan
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest
from protocol import messages as m
from protocol.codec import decode, encode
from services.planner.goals import Origin
from services.planner.replies import goal_reply, plan_message, trajectory_message
from services.robot import RobotConfig

ROUNDS = 10
SHARE = 0.95
"""Of the acceleration that the motion would like to have: so limits shape it."""


def rehearse(primitive: Primitive, config: RobotConfig) -> Plan:
    """Plan the demonstrated motion from rest some times over, all that goes over the wire included; return the last.

    Raises:
        MotionError: the arm cannot move like that.
    """
    joints = primitive.joint_count
    start = Boundary(primitive.start.positions, np.zeros(joints), np.zeros(joints))
    goal = Boundary(primitive.goal.positions, primitive.goal.velocities, np.full(joints, np.nan))
    free = MotionRequest(start, goal, primitive.duration, Limits.unlimited(joints), tail="coast")
    wished = np.abs(plan(primitive, free, config.tick).report.extremes["acceleration"]).max(axis=1)
    limits = replace(config.limits, accelerations=np.minimum(SHARE * wished, config.limits.accelerations))
    request = replace(free, limits=limits, tail="stop")
    made = plan(primitive, request, config.tick)
    for _ in range(ROUNDS):
        made = plan(primitive, request, config.tick, made.warm)
        _encoded(made, primitive, config)
    return made


def _encoded(made: Plan, primitive: Primitive, config: RobotConfig) -> None:
    """What a goal that is played puts on the wire."""
    goal = m.Goal(primitive="rehearsal", positions=made.request.goal.positions.tolist())
    origin = Origin(0.0, 0, made.request.start)
    trajectory = trajectory_message(made, goal, "rehearsal", origin, config, m.Stamps())
    decode(encode(goal), m.Goal)
    encode(trajectory)
    encode(plan_message(made, trajectory, goal, primitive))
    encode(goal_reply(made, "rehearsal", 0.0, None, 0.0, config))
