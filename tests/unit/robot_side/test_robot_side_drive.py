"""Commands that are accepted or refused by the drive, and the brake in their absence."""

import msgspec
import numpy as np
import pytest

from protocol import messages as m
from protocol.errors import Refusal
from robot.description import load_robot
from services.common.robot_side.drive import MAX_ACCELERATION, Drive

ROBOT = load_robot()
STILL = [0.0] * ROBOT.joint_count


def command(tick: int, run: int = 1) -> m.Command:
    """Return a command that answers `tick` and holds the arm at home."""
    home = ROBOT.home.tolist()
    return m.Command(
        run=run, tick=tick, source="test", accelerations=STILL, positions=home, velocities=STILL, goal_id=None
    )


@pytest.fixture
def drive() -> Drive:
    """A drive at tick 100 whose last command is of tick 50, which it repeats."""
    drive = Drive(ROBOT)
    drive.begin(1, ROBOT.home)
    drive.take(command(50), 50)
    return drive


def refused(drive: Drive, command: m.Command) -> Refusal:
    """Return the refusal of a command at tick 100, which must not change the drive."""
    with pytest.raises(Refusal) as caught:
        drive.take(command, 100)
    assert drive.answered_tick == 50
    return caught.value


@pytest.mark.parametrize("tick", [100, 81])
def test_an_answer_to_a_recent_tick_is_accepted(drive: Drive, tick: int):
    drive.take(command(tick), 100)
    assert drive.answered_tick == tick


@pytest.mark.parametrize("tick", [80, 50, 101])
def test_an_answer_to_another_tick_is_refused(drive: Drive, tick: int):
    refusal = refused(drive, command(tick))
    assert (refusal.code, refusal.detail["field"]) == ("bad_message", "tick")
    assert refusal.message == f"it answers tick {tick}; an answer to 81 … 100 is news"


def test_commands_20_ticks_late_do_not_prevent_braking(drive: Drive):
    for tick in range(51, 51 + 2 * ROBOT.silence_ticks):
        with pytest.raises(Refusal):
            drive.take(command(tick - ROBOT.silence_ticks), tick)
        drive.setpoint(ROBOT.home, np.zeros(ROBOT.joint_count))
    assert drive.brake


@pytest.mark.parametrize("name", ["accelerations", "positions", "velocities"])
@pytest.mark.parametrize("values", [STILL[1:], [*STILL, 0.0], []])
def test_a_command_with_another_joint_count_is_refused(drive: Drive, name: str, values: list[float]):
    refusal = refused(drive, msgspec.structs.replace(command(100), **{name: values}))
    assert (refusal.code, refusal.detail["field"]) == ("bad_message", name)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_command_with_an_absurd_acceleration_is_refused(drive: Drive, sign: float):
    beyond = msgspec.structs.replace(command(100), accelerations=[sign * 2 * MAX_ACCELERATION, *STILL[1:]])
    assert refused(drive, beyond).detail["field"] == "accelerations"


def test_a_command_of_another_run_is_refused(drive: Drive):
    assert refused(drive, command(100, run=2)).detail["field"] == "run"
