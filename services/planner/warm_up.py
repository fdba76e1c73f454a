"""Plan at start-up, so that the first goal finds everything built, loaded and compiled."""

from dataclasses import replace

import numpy as np

from motion.limits import Limits
from motion.plan import Plan, plan
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest
from protocol import messages as m
from protocol.codec import decode, encode
from robot.description import RobotConfig
from services.planner.goals import Origin
from services.planner.messages import executed_message, goal_reply, plan_message, sampled_message
from services.planner.solving import Made

ROUNDS = 10
SHARE = 0.95
"""Acceleration limit as a fraction of the unlimited motion's acceleration, so that limits are active."""


def warm_up(primitive: Primitive, config: RobotConfig) -> Plan:
    """Plan the demonstrated motion from rest several times, and encode its messages; return the last plan.

    Raises:
        MotionError: the arm cannot play this motion.
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
    """Encode the messages of a played goal."""
    goal = m.Goal(primitive="rehearsal", positions=made.request.goal.positions.tolist())
    motion = Made(made, 0, Origin(0.0, 0, made.request.start), 0.0)
    sampled = sampled_message(motion, goal, "rehearsal", config, m.Stamps())
    decode(encode(goal), m.Goal)
    encode(executed_message(motion, goal, "rehearsal", config, m.Stamps()))
    encode(plan_message(motion, sampled, goal, primitive))
    encode(goal_reply(motion, "rehearsal", None, config))
