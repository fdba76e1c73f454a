"""Goals in tool space through all services, on an arm of seven joints instead of the shipped one."""

from collections.abc import Iterator

import numpy as np
import pytest

from client import Arm, GoalHandle, Refusal, connect, tool
from robot.description import RobotConfig, load_robot
from robot.kinematics import Kinematics
from services.common.cell import running_cell
from services.common.cli import Options
from tests import arms
from tests.cores import LOOP_CORE
from tools.drill.harness.start import ARM as SERVICES
from tools.shell.__main__ import main

TICKS = np.linspace(0, 1, 201)
SHAPE = 3 * TICKS**2 - 2 * TICKS**3


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> RobotConfig:
    """Return an iiwa14."""
    return load_robot(arms.IIWA14.write(tmp_path_factory.mktemp("robot"), "iiwa"))


@pytest.fixture(scope="module")
def endpoint(config: RobotConfig, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Yield the endpoint of an iiwa14's services on the stepped clock."""
    file = arms.IIWA14.write(tmp_path_factory.mktemp("robot"), "iiwa")
    with running_cell(
        Options(robot_config=file, loop_core=LOOP_CORE), {"clock": "stepped"}, SERVICES, quiet=True
    ) as cell:
        yield cell.endpoint


@pytest.fixture
def arm(endpoint: str, config: RobotConfig) -> Iterator[Arm]:
    """Yield the arm at home; it has learned a movement whose columns were in another order."""
    with connect(endpoint, config.name) as arm:
        arm.reset_sim()
        arm.step(20)
        movement = config.home + np.outer(SHAPE, np.resize([0.4, -0.3], 7))
        names = config.joint_names[::-1]
        arm.learn("reach", movement[:, ::-1], times=1.2 * TICKS, joint_names=names, replace=True)
        yield arm


def at_the_hit(arm: Arm, handle: GoalHandle, judge: Kinematics) -> tuple[np.ndarray, np.ndarray]:
    """Step to the hit; return position and velocity of the tool by the measured joints."""
    hit = handle.start_time + handle.reply.duration
    arm.step(round((hit - arm.state().time) * 1000))
    state = arm.state()
    assert state.time == pytest.approx(hit)
    positions, velocities = np.array(state.positions), np.array(state.velocities)
    return judge.tool_pose(positions)[0], judge.tool_velocity(positions, velocities)


def test_the_tool_hits_and_a_correction_moves_the_hit(arm: Arm, config: RobotConfig):
    judge = Kinematics(config)
    place, rotation = judge.tool_pose(config.home + np.resize([0.3, -0.2, 0.25], 7))
    velocity = np.array([0.1, 0.2, 0.05])
    handle = arm.goal("reach", tool=tool(place, axis=rotation[:, 2], velocity=velocity))
    arm.step(500)
    moved = place + np.array([0.02, -0.01, 0.01])
    corrected = handle.correct(tool=tool(moved, axis=rotation[:, 2], velocity=velocity))
    assert np.abs(np.array(corrected.reply.positions) - handle.reply.positions).max() < 0.2, (
        "the correction changed the posture"
    )
    hit, moves = at_the_hit(arm, corrected, judge)
    assert np.abs(hit - moved).max() < 1e-4
    assert np.abs(moves - velocity).max() < 1e-3
    arm.step(800)
    result = corrected.wait(5)
    assert result.outcome == "succeeded"
    assert result.hit is not None
    assert max(map(abs, result.hit.position_error)) < 1e-4


def test_from_the_shell(arm: Arm, config: RobotConfig, endpoint: str, capsys: pytest.CaptureFixture[str]):
    place, _ = Kinematics(config).tool_pose(config.home)
    words = [f"{value + 0.05:.4f}" for value in place]
    reach = ["--robot", config.name, "--connect", endpoint]
    assert main(["goal", "reach", "--tool", *words, "--tool-axis", "1", "0", "-1", "--plan-only", *reach]) == 0
    assert "at the goal" in capsys.readouterr().out
    assert main(["goal", "reach", "--tool", "4", "0", "0", *reach]) == 1
    said = capsys.readouterr().err
    assert said.startswith("unreachable: tool: the tool cannot be at [4.000, 0.000, 0.000] m: the arm does not")
    assert "the nearest pose found is 3." in said


def test_another_arms_names_are_refused(arm: Arm, config: RobotConfig):
    (entry,) = arm.primitives()
    assert (entry.robot, entry.joint_names) == ("iiwa", list(config.joint_names)), (
        "the library lists a primitive of the shipped arm"
    )
    with pytest.raises(Refusal, match="the arm's are joint1, joint2") as caught:
        arm.learn("pour", np.zeros((20, 7)), rate=10.0, joint_names=[f"panda_{name}" for name in config.joint_names])
    assert (caught.value.code, caught.value.detail["field"]) == ("bad_message", "joint_names")
