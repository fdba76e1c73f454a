"""Play a recording with the planner's mathematics, the controller and the simulated arm in one process."""

import numpy as np
import pytest

from motion.demonstration import Demonstration
from protocol import messages as m
from robot.description import RobotConfig
from services.controller.checks import check_trajectory
from services.planner.corrections import Corrections
from services.planner.goals import origin_of
from services.planner.learning import learn_demonstration
from services.planner.messages import executed_message
from services.planner.solving import Made, Solver
from tests.closed_loop import ClosedLoop
from tools.recordings.recording import Recording

LEAD = 0.05
"""Time from the request to the motion's start, s."""

DEVIATION_SHARE, DEVIATION = 0.01, 0.005
"""Bound on the deviation of a played movement: the larger of a part of the joint's range and a distance, rad."""

HOUSEHOLD = {"bottle2shelf": 10.0, "platestandingtolying": 12.0, "pouring": 8.0}
"""Tasks and their durations, s, which the recordings lack; the plate moved faster would exceed the arm's limits."""


def relative_deviation(played: np.ndarray, shown: np.ndarray) -> np.ndarray:
    """Return the distance of played from shown positions, both (n, J), rad, as a multiple of its bound."""
    bound = np.maximum(DEVIATION_SHARE * np.ptp(shown, axis=0), DEVIATION)
    return np.abs(played - shown) / bound


def play(recording: Recording, robot: RobotConfig) -> np.ndarray:
    """Learn a recording and play it within the robot's limits, on a robot at rest at its start.

    Returns the arm's positions at the recording's times (n, J), rad.
    """
    primitive = learn_demonstration(Demonstration(recording.times, recording.values), "auto")
    loop = ClosedLoop(robot, positions=primitive.start.positions.tolist())
    reference = loop.controller.reference(m.ReferenceRequest(lead=LEAD))
    goal = m.Goal(primitive="recorded", place_time=0.05)
    with pytest.raises(StopIteration) as solved:
        next(Solver(robot).solve(goal, primitive, origin_of(goal, reference, Corrections(), robot)))
    made: Made = solved.value.value
    motion = executed_message(made, goal, "played", robot, m.Stamps())
    loop.controller.execute(check_trajectory(motion, robot), (), now_ns=0)
    times, places = [], []
    for _ in range(round((LEAD + made.plan.total_duration + 0.1) * robot.rate_hz)):
        now = loop.arm.observe()
        times.append(now.tick * robot.tick)
        places.append(now.positions.copy())
        loop.turn(1)
    assert loop.controller.ledger.result("played").outcome == "succeeded"
    at = made.origin.time + recording.times - recording.times[0]
    return np.stack([np.interp(at, times, column) for column in np.array(places).T], axis=1)
