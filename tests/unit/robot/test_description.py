"""The robot's description: values of the shipped one, defaults, and refusals of invalid ones."""

from pathlib import Path

import models
import mujoco
import numpy as np
import pytest

from robot.description import Collision, load_robot
from robot.kinematics import Kinematics
from robot.model import Tool, compile_model
from robot.schema import RobotError, Tolerance
from robot.shipped import DEFAULT_ROBOT_CONFIG
from robot.urdf import read_urdf

PAPER_POSES = {
    "home": (0.0, 0.52, 0.82, -0.2, 0.0, 0.09),
    "prepare": (-0.14, 0.52, 0.82, 0.1645, 0.0, -0.0353),
    "hit": (0.17, 0.47, 0.86, -0.0822, 0.0, 0.1058),
}

TWO_LINKS = """
<mujoco>
  <worldbody>
    <body name="upper">
      <joint name="a" axis="0 0 1" {first}/>
      <geom type="capsule" size="0.05" fromto="0 0 0 0.5 0 0"/>
      <body name="lower" pos="0.5 0 0">
        <joint name="b" axis="0 0 1"/>
        <geom type="capsule" size="0.05" fromto="0 0 0 0.5 0 0"/>
        <site name="tip" pos="0.5 0 0"/>
        <body name="finger" pos="0.5 0 0">
          <joint name="grip" type="slide" axis="0 1 0" limited="true" range="0 0.04"/>
          <geom type="box" size="0.01 0.01 0.01"/>
        </body>
      </body>
    </body>
    <site name="ground"/>
  </worldbody>
  <keyframe><key name="up" qpos="0.6 0.5 0.03"/></keyframe>
  <actuator>{actuators}</actuator>
</mujoco>
"""

TWO_LINKS_TOML = """
name = "two"
model = "two.xml"
tool = "tip"
rate_hz = 500
alpha = 50.0
silence_ticks = 20
max_tracking_error = 0.3
[joints]
names = ["a", "b"]
home = [0.1, 0.2]
velocities = [1.0, 2.0]
accelerations = [3.0, 4.0]
jerks = [5.0, 6.0]
"""


def write_robot(folder: Path, toml: str = TWO_LINKS_TOML, first: str = "", actuators: str = "") -> Path:
    (folder / "two.xml").write_text(TWO_LINKS.format(first=first, actuators=actuators))
    (folder / "two.toml").write_text(toml)
    return folder / "two.toml"


def test_the_shipped_arms_limits_allow_the_papers_cases():
    robot = load_robot()
    assert robot.name == "arm"
    assert robot.joint_count == 6
    assert robot.limits.positions[0, 0] <= -2.0
    assert robot.limits.positions[0, 1] >= 2.0
    assert robot.limits.velocities[0] >= 15
    assert robot.limits.accelerations[0] >= 300
    assert robot.limits.jerks[0] >= 15_000
    assert robot.alpha == 50
    assert robot.rate_hz == 1000
    assert robot.tick == 0.001
    assert robot.silence_ticks == 20
    assert robot.max_tracking_error > 0.16, "the paper's push deflects 0.16 rad and is not a fault"
    for name, pose in PAPER_POSES.items():
        inside = (robot.limits.positions[:, 0] < pose) & (pose < robot.limits.positions[:, 1])
        assert inside.all(), name
    np.testing.assert_array_equal(robot.home, PAPER_POSES["home"])


def test_the_default_description_does_not_depend_on_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    assert load_robot().mjcf_path == DEFAULT_ROBOT_CONFIG.parent / "arm.xml"
    assert load_robot(str(DEFAULT_ROBOT_CONFIG)).name == "arm"


def test_the_acceleration_limits_are_reachable_in_the_papers_poses():
    """For all joints in the worst combination of signs, against gravity and a push of 100 rad/s² on any joint."""
    robot = load_robot()
    model = robot.load_model()
    data = mujoco.MjData(model)
    inertia = np.zeros((model.nv, model.nv))
    for pose in PAPER_POSES.values():
        data.qpos[:6] = pose
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, inertia)
        arm = np.abs(inertia[:6, :6])
        need = arm @ robot.limits.accelerations + 100 * np.diag(arm) + np.abs(data.qfrc_bias[:6])
        assert (need < robot.torques).all()


def test_limits_and_torques_are_read_from_the_model(tmp_path: Path):
    actuators = '<motor joint="a" gear="3" ctrlrange="-2 2"/><position joint="b" kp="9" forcerange="-4 5"/>'
    robot = load_robot(write_robot(tmp_path, first='limited="true" range="-90 90"', actuators=actuators))
    np.testing.assert_allclose(robot.limits.positions, [[-np.pi / 2, np.pi / 2], [-np.inf, np.inf]])
    np.testing.assert_array_equal(robot.torques, [6, 4])
    np.testing.assert_array_equal(robot.limits.jerks, [5, 6])


def test_a_position_servos_control_range_is_not_a_torque_limit(tmp_path: Path):
    actuators = '<position joint="a" kp="9" ctrlrange="-1 1"/>'
    robot = load_robot(write_robot(tmp_path, first='actuatorfrcrange="-7 7"', actuators=actuators))
    np.testing.assert_array_equal(robot.torques, [7, np.inf])


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("alpha = 50.0", "", "missing required field `alpha`"),
        ("alpha = 50.0", "alpha = 50.0\ngain = 1", "unknown field `gain`"),
        ("alpha = 50.0", 'alpha = "50"', "Expected `float`, got `str`"),
        ("alpha = 50.0", "alpha = nan", "alpha: nan is not a finite number greater than 0"),
        ("silence_ticks = 20", "silence_ticks = 0", "silence_ticks: 0 is not"),
        ("[joints]", "[joints", "Expected ']'"),
        ("home = [0.1, 0.2]", "home = [0.1]", "joints.home: has 1 values for 2 joints"),
        ("home = [0.1, 0.2]", "home = [2.5, 0.2]", "joints.home: a: 2.5 lies outside its range -1.5 to 1.5"),
        ("home = [0.1, 0.2]", "home = [0.1, nan]", "joints.home: b: nan lies outside"),
        ("jerks = [5.0, 6.0]", "jerks = [5.0, 0.0]", "joints.jerks: b: 0.0 is not greater than 0"),
        ('names = ["a", "b"]', 'names = ["a", "c"]', "joints.names: the model has no joint 'c'; it has a, b, grip"),
        ('names = ["a", "b"]', 'names = ["a", "a"]', "joints.names: needs one or more names, each once"),
        ('tool = "tip"', 'tool = "tool"', "tool: the model has no site 'tool'; it has ground, tip"),
        ('tool = "tip"', 'tool = "ground"', "tool: none of joints.names moves 'ground'"),
        ('tool = "tip"', 'tool = {body = "hand"}', "tool: the model has no body 'hand'; it has upper, lower, finger"),
        ('tool = "tip"', 'tool = {body = "lower", quaternion = [0, 0, 0, 0]}', "tool.quaternion: [0.0, 0.0, 0.0, 0.0]"),
        ('tool = "tip"', 'tool = {body = "lower", position = [0, 0, inf]}', "tool.position: [0.0, 0.0, inf] is not"),
        ('name = "two"', 'name = "two*"', "name: 'two*' cannot be a part of a key"),
        ('name = "two"', 'name = "/two"', "name: '/two' cannot be a part of a key"),
        ('name = "two"', 'name = "../two"', "name: '../two' cannot be a part of a key"),
        ('name = "two"', 'name = "two\\n"', "name: 'two\\n' cannot be a part of a key"),
        ("alpha = 50.0", "alpha = 1001.0", "alpha: 1001 makes tracking unstable at 500 ticks a second; it must be at"),
        ("alpha = 50.0", 'alpha = 50.0\non_fault = "go on"', '\'go on\' - at `$.on_fault`; write "hold" or "stop"'),
        ("[joints]", "[tolerance]\npositions = 0.0\n[joints]", "tolerance.positions: 0.0 is not greater than 0"),
        (
            "[joints]",
            "[racket.recoil]\nwindow = inf\npositions = 0.5\nvelocities = 9.0\n[joints]",
            "racket.recoil.window: inf is not a finite number greater than 0",
        ),
        (
            "[joints]",
            "[racket.recoil]\nwindow = 0.1\npositions = 0.2\nvelocities = 9.0\n[joints]",
            "racket.recoil: max_tracking_error = 0.3 must lie between tolerance = 0.02 and positions = 0.2",
        ),
        ("[joints]", "[held]\nc = 0.0\n[joints]", "held: the model has no joint 'c'; it has a, b, grip"),
        ("[joints]", "[held]\nb = 0.0\n[joints]", "held.b: is one of joints.names"),
        ("[joints]", "[held]\ngrip = 0.1\n[joints]", "held.grip: 0.1 lies outside its range 0 to 0.04"),
        ("[joints]", "[collision]\nmargin = -1.0\n[joints]", "collision.margin: -1.0 is not a finite"),
        ("[joints]", '[collision]\nignore = [["upper", "x"]]\n[joints]', "collision.ignore: the model has no body 'x'"),
        ("[joints]", "[joints]\npositions = [[-2.0, 1.0], [-1.0, 1.0]]", "a: -2 to 1 is wider than the model's"),
        ("[joints]", "[joints]\npositions = [[1.0, -1.0], [-1.0, 1.0]]", "joints.positions: a: 1 to -1 is not a range"),
        ("[joints]", "[joints]\ntorques = [9.0, 1.0]", "joints.torques: a: 9 N·m is more than the model's 7 N·m"),
        ("home = [0.1, 0.2]", 'home = "keyframe:away"', "'keyframe:away' is not a keyframe of the model; it has"),
        ('model = "two.xml"', 'model = "three.xml"', "three.xml'; name an MJCF or URDF file"),
        ('model = "two.xml"', 'model = ""', "model: there is no file"),
        ('model = "two.xml"', 'model = "two.toml"', "model: 'two.toml' ends neither in .xml (MJCF) nor in .urdf"),
    ],
)
def test_an_invalid_description_is_refused_with_file_and_key(tmp_path: Path, old: str, new: str, sentence: str):
    assert old in TWO_LINKS_TOML
    limits = 'limited="true" range="-85.9436693 85.9436693" actuatorfrcrange="-7 7"'
    path = write_robot(tmp_path, TWO_LINKS_TOML.replace(old, new), first=limits)
    with pytest.raises(RobotError) as raised:
        load_robot(path)
    assert sentence in str(raised.value)
    assert "\n" not in str(raised.value)
    assert str(path) in str(raised.value)


def test_optional_fields_have_defaults(tmp_path: Path):
    robot = load_robot(write_robot(tmp_path))
    assert (robot.tool, robot.on_fault, robot.held) == (Tool("tip"), "hold", {})
    assert robot.tolerance == Tolerance(np.inf, np.inf)
    assert robot.collision == Collision(0.01, frozenset())


FULL = """
on_fault = "stop"
[tolerance]
velocities = 0.1
[held]
grip = 0.04
[collision]
margin = 0.002
ignore = [["upper", "finger"]]
[joints]
positions = [[-1.0, inf], [-inf, 2.0]]
torques = [5.0, inf]
"""


def test_optional_fields_are_read(tmp_path: Path):
    toml = TWO_LINKS_TOML.replace("[joints]", FULL).replace("[0.1, 0.2]", '"keyframe:up"')
    robot = load_robot(write_robot(tmp_path, toml, first='limited="true" range="-85.9436693 85.9436693"'))
    assert (robot.on_fault, robot.held, robot.home.tolist()) == ("stop", {"grip": 0.04}, [0.6, 0.5])
    assert robot.tolerance == Tolerance(velocities=0.1)
    assert robot.collision == Collision(0.002, frozenset([frozenset(["upper", "finger"])]))
    np.testing.assert_allclose(robot.limits.positions, [[-1.0, 1.5], [-np.inf, 2.0]])
    np.testing.assert_array_equal(robot.torques, [5.0, np.inf])


def test_a_rounded_position_is_moved_onto_the_end_of_its_range(tmp_path: Path):
    toml = TWO_LINKS_TOML.replace("[0.1, 0.2]", "[1.5708, 0.2]\npositions = [[-1.571, 1.571], [-inf, inf]]")
    robot = load_robot(write_robot(tmp_path, toml, first='limited="true" range="-90 90"'))
    assert robot.home[0] == robot.limits.positions[0, 1] == np.pi / 2


def test_a_tool_can_be_defined_relative_to_a_body(tmp_path: Path):
    toml = TWO_LINKS_TOML.replace('"tip"', '{body = "lower", position = [0.5, 0, 0.1], quaternion = [0, 2, 0, 0]}')
    position, rotation = Kinematics(load_robot(write_robot(tmp_path, toml))).tool_pose(np.zeros(2))
    np.testing.assert_allclose(position, [1.0, 0, 0.1], atol=1e-12)
    np.testing.assert_allclose(rotation, np.diag([1, -1, -1]), atol=1e-12)


@pytest.mark.parametrize("model", [models.UR5E_URDF, models.SO101_URDF])
def test_links_of_a_urdf_remain_bodies(model: Path):
    """Any of them can be the tool, and the trace shows their names; neighbours do not collide."""
    spec = mujoco.MjSpec.from_file(str(model))
    names = {body.name for body in spec.bodies} - {"world"}
    compiled = compile_model(model, Tool("tip", max(names)), read_urdf(model))
    assert {compiled.body(i).name for i in range(compiled.nbody)} >= names
    assert compiled.site("tip").name == "tip"
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    assert data.ncon == 0


def test_a_missing_description_is_refused_with_its_path(tmp_path: Path):
    with pytest.raises(RobotError, match=r"none\.toml: cannot be read"):
        load_robot(tmp_path / "none.toml")


def test_tool_pose_and_velocity_agree_with_closed_form_and_differences(tmp_path: Path):
    kinematics = Kinematics(load_robot(write_robot(tmp_path)))
    positions, velocities = np.array([0.3, 0.4]), np.array([1.0, -2.0])
    position, rotation = kinematics.tool_pose(positions)
    np.testing.assert_allclose(position[:2], 0.5 * np.array([np.cos(0.3) + np.cos(0.7), np.sin(0.3) + np.sin(0.7)]))
    np.testing.assert_allclose(rotation[:, 0], [np.cos(0.7), np.sin(0.7), 0], atol=1e-12)
    step = 1e-6
    moved, _ = kinematics.tool_pose(positions + step * velocities)
    measured = kinematics.tool_velocity(positions, velocities)
    np.testing.assert_allclose(measured, (moved - position) / step, atol=1e-5)


def test_the_racket_faces_forwards_in_the_papers_hit_pose():
    position, rotation = Kinematics(load_robot()).tool_pose(np.array(PAPER_POSES["hit"]))
    assert position[2] > 0.8
    assert rotation[0, 2] > 0.9, "the normal is the site's z axis"
    assert 0 < rotation[2, 2] < 0.2, "slightly open, so that the ball rises"
