"""What an arm makes of a recording: the planner's mathematics, the controller and the simulated arm, in one process."""

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
"""s, from asking for a motion until it begins."""

DEVIATION_SHARE, DEVIATION = 0.01, 0.005
"""Of a joint's range, and rad: the larger is the bound of a played movement."""

HOUSEHOLD = {"bottle2shelf": 10.0, "platestandingtolying": 12.0, "pouring": 8.0}
"""Tasks and their durations, s, which the recordings do not have; the arm's limits lead a shorter plate beside it."""


def in_bounds(played: np.ndarray, shown: np.ndarray) -> np.ndarray:
    """Distance of positions from those that were shown, both (n, J), rad, in units of the bound."""
    bound = np.maximum(DEVIATION_SHARE * np.ptp(shown, axis=0), DEVIATION)
    return np.abs(played - shown) / bound


def play(recording: Recording, robot: RobotConfig) -> np.ndarray:
    """Learn a recording and play it on a robot that rests where it begins, inside the robot's limits.

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
