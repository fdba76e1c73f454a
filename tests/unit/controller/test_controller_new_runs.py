"""Whether a state with an old tick begins a new run."""

import pytest

from services.controller.modes import Mode
from tests.unit.controller.perfect_arm import JOINTS, ROBOT, PerfectArm, execute, trajectory


def test_tick_0_of_the_same_run_begins_a_new_run_in_stepped_time(arm: PerfectArm):
    """In stepped time the seed is the run's number, and a seed may be repeated."""
    arm.controller.states.stepped = True
    execute(arm, trajectory(arm.controller, 30))
    arm.turn(100)
    pose = (ROBOT.home + 0.1).tolist()
    still = [0.0] * JOINTS
    begun = arm.state(tick=0, positions=pose, velocities=still, accelerations=still)
    command = arm.controller.answer(begun, 0)
    assert command is not None
    assert command.positions == pose
    assert arm.controller.ledger.result("goal").outcome == "aborted"
    assert arm.controller.mode is Mode.HOLDING


@pytest.mark.parametrize("tick", [0, -5])
def test_in_real_time_an_old_tick_begins_no_run(arm: PerfectArm, tick: int):
    """A replayed state would otherwise move the reference back to where the arm was then."""
    execute(arm, trajectory(arm.controller, 30))
    arm.turn(100)
    assert arm.controller.answer(arm.state(tick=tick), 0) is None
    assert arm.controller.mode is Mode.TRACKING
