"""Arms of other projects in closed loop: joint friction, held joints, and collisions."""

from pathlib import Path

import models
import numpy as np
import pytest

from protocol import messages as m
from protocol.errors import Refusal
from robot.description import RobotConfig
from tests.closed_loop import ClosedLoop, write_robot

UR5E_JOINTS = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
UR5E_HOME = "[-1.57, -1.57, 1.57, -1.57, -1.57, 0.0]"
CELL = """
<mujoco>
  <asset>
    <model name="arm" file="{arm}"/>
    {gripper}
  </asset>
  <worldbody>
    <attach model="arm" body="base" prefix="ur5e/"/>
    {more}
  </worldbody>
</mujoco>
"""
TABLE = '<geom name="table" type="box" size="0.6 0.6 0.02" pos="0 0.8 0.1"/>'
GRIPPER_MODEL = f'<model name="gripper" file="{models.GRIPPER_2F85}"/>'
GRIPPER = '<body pos="1 0 1"><attach model="gripper" body="base_mount" prefix="gripper/"/></body>'


def ur5e(folder: Path, scene: str, more: str = "") -> RobotConfig:
    """Write a cell with a UR5e and the bodies of `scene`, and return its robot."""
    cell = folder / "cell.xml"
    gripper = GRIPPER_MODEL if scene == GRIPPER else ""
    cell.write_text(CELL.format(arm=models.UR5E, gripper=gripper, more=scene))
    names = [f"ur5e/{name}_joint" for name in UR5E_JOINTS]
    return write_robot(folder, cell, '"ur5e/attachment_site"', names, UR5E_HOME, more)


@pytest.mark.parametrize(
    ("model", "tool", "names", "held"),
    [
        (models.FR3, "TCP", [f"joint{k}" for k in range(1, 8)], ""),
        (models.Z1, "TCP", [f"joint{k}" for k in range(1, 7)], "[held]\njointGripper = -0.5"),
    ],
    ids=["FR3", "Z1"],
)
def test_joint_friction_is_compensated(tmp_path: Path, model: Path, tool: str, names: list[str], held: str):
    """In motion, at reversals and at rest."""
    loop = ClosedLoop(write_robot(tmp_path, model, f'"{tool}"', names, '"keyframe:home"', held))
    result = loop.move({"joint1": 0.6, "joint2": 0.3, "joint5": -0.4}, 1.0)
    loop.turn(1300)
    assert result.outcome == "succeeded"
    assert result.peak_tracking_error < 1e-5
    rest = np.abs(np.array(loop.arm.observe().velocities)).max()
    assert rest < 1e-6, "no chatter"


def test_fingers_are_held_and_moved_smoothly(tmp_path: Path):
    """Neither affects the arm's motion; the other finger follows by the model's equality constraint."""
    names = [f"joint{k}" for k in range(1, 8)]
    held = "[held]\nfinger_joint1 = 0.02"
    loop = ClosedLoop(write_robot(tmp_path, models.PANDA, '"TCP"', names, '"keyframe:home"', held))
    result = loop.move({"joint1": 0.6, "joint6": 0.6}, 1.0)
    loop.turn(500)
    assert loop.arm.observe().held == pytest.approx({"finger_joint1": 0.02}, abs=1e-5)
    assert loop.arm.hold({"finger_joint1": 0.04}) == pytest.approx(0.52)
    positions = []
    for _ in range(700):
        loop.turn(1)
        positions.append(loop.arm.observe().held["finger_joint1"])
    assert np.abs(np.diff(positions, n=2)).max() < 1e-6, "no jump"
    assert positions[-1] == pytest.approx(0.04, abs=1e-5)
    assert result.outcome == "succeeded"
    assert result.peak_tracking_error < 5e-5


@pytest.mark.parametrize(
    ("targets", "code", "words"),
    [
        ({"gripper/left_driver_joint": 0.1}, "bad_message", "is not a held joint; this robot's config has gripper/r"),
        (
            {"gripper/right_driver_joint": 0.9},
            "limit",
            "gripper/right_driver_joint at 0.9 rad lies outside its range 0 to",
        ),
    ],
)
def test_invalid_targets_of_held_joints_are_refused(
    gripper: ClosedLoop, targets: dict[str, float], code: str, words: str
):
    with pytest.raises(Refusal, match=words) as refused:
        gripper.arm.hold(targets)
    assert refused.value.code == code


@pytest.fixture(scope="module")
def gripper(tmp_path_factory: pytest.TempPathFactory) -> ClosedLoop:
    """A UR5e next to a 2F-85 gripper, which has closed kinematic loops."""
    held = '[held]\n"gripper/right_driver_joint" = 0.1'
    return ClosedLoop(ur5e(tmp_path_factory.mktemp("gripper"), GRIPPER, held))


def test_a_gripper_with_closed_kinematic_loops_is_held(gripper: ClosedLoop):
    """One of its two driver joints is held."""
    gripper.arm.hold({"gripper/right_driver_joint": 0.6})
    gripper.turn(1500)
    assert gripper.arm.observe().held["gripper/right_driver_joint"] == pytest.approx(0.6, abs=0.003)


JAWS = """
<mujoco>
  <worldbody>
    <body name="link">
      <joint name="a" axis="0 0 1"/>
      <geom size="0.05" mass="1"/>
      <geom name="object" type="box" size="0.02 0.02 0.02" pos="0.3 0.07 0" mass="0.1"/>
      <site name="tip" pos="0.3 0 0"/>
      <body name="jaw" pos="0.3 0 0">
        <joint name="jaw" type="slide" axis="0 1 0" range="0 0.1"/>
        <geom name="jaw" type="box" size="0.02 0.02 0.02" mass="0.1"/>
      </body>
    </body>
  </worldbody>
  <contact><pair geom1="object" geom2="jaw"/></contact>
</mujoco>
"""


def test_a_jaw_blocked_by_an_object_does_not_disturb_the_arm(tmp_path: Path):
    """Its servo continues to press against the object."""
    model = tmp_path / "jaws.xml"
    model.write_text(JAWS)
    loop = ClosedLoop(write_robot(tmp_path, model, '"tip"', ["a"], "[0.0]", "[held]\njaw = 0.0"))
    loop.arm.hold({"jaw": 0.1})
    loop.turn(800)
    assert loop.arm.observe().held["jaw"] < 0.04
    assert np.abs(loop.arm.observe().positions).max() < 1e-4


def move_to_fault(loop: ClosedLoop, joint: str, change: float) -> m.Result:
    """Move a joint against an obstacle until the controller faults, and return the motion's result."""
    result = loop.move({f"ur5e/{joint}_joint": change}, 2.0)
    for _ in range(2500):
        loop.turn(1)
        if loop.controller.fault:
            break
    assert result.outcome == "aborted"
    return result


@pytest.mark.parametrize(
    ("scene", "joint", "change", "error", "bodies"),
    [
        (TABLE, "shoulder_lift", 1.9, 0.3, {"ur5e/wrist_3_link", "table"}),
        ("", "elbow", 1.55, 0.15, {"ur5e/wrist_3_link", "ur5e/upper_arm_link"}),
    ],
    ids=["the table", "itself"],
)
def test_after_a_fault_the_arm_does_not_press_against_the_obstacle(
    tmp_path: Path, scene: str, joint: str, change: float, error: float, bodies: set[str]
):
    """Within 100 ms torques drop to gravity compensation; the contact is reported at its beginning."""
    loop = ClosedLoop(ur5e(tmp_path, scene, f"max_tracking_error = {error}"))
    result = move_to_fault(loop, joint, change)
    before = np.abs(loop.torques[-2])
    assert result.first_contact is not None
    assert {result.first_contact.body, result.first_contact.other} == bodies
    assert f"touched {result.first_contact.other} at" in result.reason
    assert [contact.ended for contact in loop.contacts[:1]] == [False]
    assert (before / loop.config.torques).max() > 0.5, "it pressed before the fault"
    loop.turn(100)
    after = np.array(loop.torques[-1:]), len(loop.torques)
    loop.turn(1000)
    gravity = np.abs(loop.arm.observe().torques)
    pressed = np.abs(np.array(loop.torques[after[1] - 1 :])) - gravity
    assert (pressed / loop.config.torques).max() < 0.05
    assert np.abs(loop.arm.observe().velocities).max() < 1e-3
    assert loop.controller.reset().mode == "holding"


def test_with_on_fault_stop_the_arm_presses_against_the_obstacle(tmp_path: Path):
    """The braking trajectory ends inside the table."""
    loop = ClosedLoop(ur5e(tmp_path, TABLE, 'on_fault = "stop"'))
    move_to_fault(loop, "shoulder_lift", 1.9)
    loop.turn(1000)
    assert np.abs(loop.arm.observe().torques / loop.config.torques).max() == 1.0


def test_a_hit_outside_its_tolerance_is_missed(tmp_path: Path):
    """The goal's own tolerance, or else the robot's."""
    loop = ClosedLoop(ur5e(tmp_path, "", "[tolerance]\npositions = 0.01"))
    played = []
    for tolerance in (None, m.Tolerance(positions=0.5), m.Tolerance(positions=0.5, velocities=0.01)):
        given = {} if tolerance is None else {"tolerance": tolerance}
        played.append(loop.move({"ur5e/wrist_3_joint": 0.5}, 0.6, **given))
        loop.arm.disturb(m.Disturb(kind="acceleration", values=[0.0] * 5 + [40.0], duration=0.3))
        loop.turn(900)
    assert [result.outcome for result in played] == ["missed", "succeeded", "missed"]
    assert "ur5e/wrist_3_joint was" in played[0].reason
    assert "rad off at the hit, more than 0.01 rad" in played[0].reason
    assert "rad/s off at the hit, more than 0.01 rad/s" in played[2].reason
