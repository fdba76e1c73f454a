"""Deviations by a ball or a push are accepted as recoil near a hit and cause a fault elsewhere."""

import dataclasses

import msgspec
import numpy as np
import pytest

from protocol import messages as m
from robot.description import RobotConfig, load_robot
from robot.kinematics import Kinematics
from tests.closed_loop import ClosedLoop

ROBOT = load_robot()
STRICT = dataclasses.replace(ROBOT, max_tracking_error=0.1)
HIT = 219
"""Tick of the hit of `swing`, which begins at tick 19 and has its hit after 200 of 400 ticks."""
PUSH = 400.0
"""Acceleration on joint_1 for 60 ms, rad/s²: a deviation of 0.33 rad, or 0.44 rad if the return keeps the limits."""
AWAY = m.Ball(position=(3.0, 3.0, 1.0), velocity=(0.0, 0.0, 0.0))
"""A ball outside the arm's reach."""


def swing(loop: ClosedLoop) -> m.Result:
    """Swing joint_1 by 0.5 rad in 0.4 s."""
    return loop.move({"joint_1": 0.5}, 0.4)


def push(loop: ClosedLoop, tick: int, acceleration: float = PUSH) -> None:
    """Push joint_1 back for 60 ms from `tick` on."""
    values = [-acceleration, *[0.0] * (loop.config.joint_count - 1)]
    loop.arm.disturb(m.Disturb(kind="acceleration", values=values, start_time=tick * loop.config.tick, duration=0.06))


def accelerations_used(loop: ClosedLoop) -> float:
    """Return the largest acceleration commanded, as a part of its limit."""
    return float(np.abs(np.array(loop.accelerations) / loop.config.limits.accelerations).max())


def flight(robot: RobotConfig, speed: float, aside: float) -> m.Ball:
    """Return a ball that meets the racket of `swing` head-on at the hit, `aside` m from its middle."""
    loop = ClosedLoop(robot)
    swing(loop)
    loop.turn(HIT - 10)
    here = np.array(loop.arm.observe().positions)
    position, rotation = Kinematics(robot).tool_pose(here)
    time, across = HIT * robot.tick, -speed * rotation[:, 2]
    fall = np.array([0.0, 0.0, -9.81 * time])
    start = position + 0.041 * rotation[:, 2] + aside * rotation[:, 0] - (across + fall / -2) * time
    return m.Ball(position=start.tolist(), velocity=(across - fall).tolist())


@pytest.mark.parametrize("accepted", [True, False])
def test_a_hit_causes_a_recoil_or_without_its_table_a_fault(accepted: bool):
    """With the table [racket.recoil] the goal succeeds, and its result has the recoil's size and duration."""
    robot = STRICT if accepted else dataclasses.replace(STRICT, recoil=None)
    loop = ClosedLoop(robot, flight(robot, 20.0, 0.1))
    result = swing(loop)
    loop.turn(700)
    assert result.first_contact is not None
    assert result.first_contact.other == "ball"
    if not accepted:
        assert result.outcome == "aborted"
        assert result.recoil is None
        return
    assert loop.controller.fault is None
    assert result.outcome == "succeeded"
    assert result.recoil is not None
    assert 0.1 < result.recoil.peak_error == result.peak_tracking_error < 0.5
    assert result.recoil.back_time is not None
    assert result.recoil.time < result.recoil.peak_time < result.recoil.back_time < HIT * ROBOT.tick + 0.3
    assert accelerations_used(loop) <= 1.0
    assert np.abs(np.array(loop.arm.observe().velocities)).max() < 5e-3


@pytest.mark.parametrize(("after", "faults"), [(-209, True), (-60, False), (0, False), (100, True)])
def test_a_push_is_a_recoil_only_within_the_window(after: int, faults: bool):
    """The window is ±0.14 s around the planned hit."""
    assert ROBOT.recoil is not None
    recoil = msgspec.structs.replace(ROBOT.recoil, window=0.14)
    loop = ClosedLoop(dataclasses.replace(ROBOT, recoil=recoil), AWAY)
    result = swing(loop)
    push(loop, HIT + after)
    loop.turn(800)
    assert (loop.controller.fault is not None) == faults
    assert result.outcome == ("aborted" if faults else "succeeded")
    assert (result.recoil is not None and result.recoil.back_time is not None) != faults
    assert result.peak_tracking_error > ROBOT.max_tracking_error


def test_a_deviation_beyond_the_accepted_recoil_is_a_fault():
    """The fault's message has the accepted recoil."""
    loop = ClosedLoop(ROBOT, AWAY)
    result = swing(loop)
    push(loop, HIT, 600.0)
    loop.turn(HIT + 100)
    assert loop.controller.fault is not None
    assert "beyond the recoil of 0.5 rad and 20 rad/s" in loop.controller.fault
    assert result.outcome == "aborted"
    assert result.recoil is not None
    assert result.recoil.back_time is None


def test_a_hit_at_rest_has_no_window():
    """A motion that ends at its goal is no strike."""
    loop = ClosedLoop(ROBOT, AWAY)
    loop.move({"joint_1": 0.5}, 0.4, hit_index=400)
    push(loop, 420)
    loop.turn(700)
    assert loop.controller.fault is not None


def test_a_recoil_may_continue_during_the_next_goal():
    """It is reported by the goal that had the hit."""
    loop = ClosedLoop(ROBOT, AWAY)
    struck = swing(loop)
    push(loop, HIT + 10)
    loop.turn(415)
    back = loop.move({}, 0.5, hit_index=500)
    assert struck.outcome == "succeeded"
    assert struck.recoil is not None
    assert struck.recoil.back_time is None
    loop.turn(700)
    assert loop.controller.fault is None
    assert struck.recoil.back_time is not None
    assert (back.outcome, back.recoil) == ("succeeded", None)


def test_without_a_deviation_the_recoil_table_does_not_change_commands():
    accepting, strict = ClosedLoop(ROBOT, AWAY), ClosedLoop(dataclasses.replace(ROBOT, recoil=None), AWAY)
    for loop in (accepting, strict):
        swing(loop)
        loop.turn(500)
    assert np.array_equal(accepting.accelerations, strict.accelerations)
    assert accepting.controller.ledger.take_ended()[0].recoil is None
