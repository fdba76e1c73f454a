"""Swings without the planner, for comparison: one polynomial of degree 5, sent as `execute`."""

import time
from functools import partial
from typing import Any

import numpy as np

from motion.errors import MotionError
from motion.quintic_plan import plan_quintic
from motion.request import Boundary, MotionRequest
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.queues import Inbox
from protocol.codec import matrix_bytes
from protocol.errors import Refusal
from robot.conversions import collision_refusal
from robot.description import RobotConfig
from robot.motion_check import Collides, MotionCheck
from services.striker.bus_link import BusLink, GoalAnswer
from services.striker.link import AcceptedGoal

LEAD_S = 0.02
"""Lead from the reference to the begin of a motion, s, for planning and the controller's check."""
SHORTEST_S = 0.02


class QuinticLink(BusLink):
    """Executes hits as polynomials; the planner still plans the return. Needs a role that may execute."""

    def __init__(self, bus: Bus, inbox: Inbox[Any], config: RobotConfig) -> None:
        super().__init__(bus, inbox)
        self._config = config
        self._motions = MotionCheck(config)

    def send_goal(self, goal: m.Goal) -> None:
        """Send a goal; the polynomial of a hit is planned when the loop reads the reply."""
        if goal.arrival_time is None:
            super().send_goal(goal)
        else:
            self._inbox.offer(GoalAnswer(goal.goal_id or "", partial(self._play, goal)))

    def _play(self, goal: m.Goal) -> AcceptedGoal:
        requested = time.time_ns()
        reference = self._bus.ask(topics.REFERENCE, m.ReferenceRequest(lead=LEAD_S))
        trajectory = quintic_message(goal, reference, self._config, self._motions, requested)
        accepted = self._bus.ask(topics.EXECUTE, trajectory)
        rest = accepted.start_time + (trajectory.count - 1) * trajectory.dt
        return AcceptedGoal(accepted.goal_id, accepted.start_time, rest)


def quintic_message(
    goal: m.Goal, reference: m.Reference, config: RobotConfig, motions: MotionCheck, requested_ns: int
) -> m.Trajectory:
    """Return the trajectory from `reference` to the hit of a goal; the controller checks its limits.

    Raises:
        Refusal: `late`; `cannot_stop`; `collision`, which the controller does not check.
    """
    assert goal.positions is not None
    assert goal.velocities is not None
    assert goal.arrival_time is not None
    ticks = round((goal.arrival_time - reference.time) / config.tick)
    if ticks * config.tick < SHORTEST_S:
        raise Refusal(
            "late", f"arrival_time {goal.arrival_time:.3f} s is too near; the motion can begin at {reference.time} s"
        )
    start = Boundary(*map(np.array, (reference.positions, reference.velocities, reference.accelerations)))
    end = Boundary(np.array(goal.positions), np.array(goal.velocities), np.zeros(config.joint_count))
    request = MotionRequest(start, end, ticks * config.tick, config.limits, follow_through=goal.follow_through)
    try:
        motion = plan_quintic(request)
        motions.check(motion, motion.duration, torque=False)
    except Collides as error:
        raise collision_refusal(error) from None
    except MotionError as error:
        raise Refusal("cannot_stop", str(error)) from None
    return m.Trajectory(
        goal_id=goal.goal_id or "",
        client_id=goal.client_id,
        epoch=reference.epoch,
        joint_names=list(config.joint_names),
        start_time=reference.time,
        dt=config.tick,
        count=int(np.ceil(motion.duration / config.tick - 1e-9)) + 1,
        hit_index=ticks,
        stamps=m.Stamps(requested=requested_ns, planned=time.time_ns()),
        pieces=m.Pieces(breaks=motion.breaks.tolist(), coefficients=matrix_bytes(motion.coefficients)),
    )
