"""Import of models of other projects: values found, derived and assumed; the written description loads."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from robot.checking.checks import check_robot
from robot.description import RobotConfig, load_robot
from robot.importing.arm import import_robot
from robot.importing.document import open_values
from robot.schema import RobotError
from robot.shipped import DEFAULT_ROBOT_CONFIG
from robot.tree import touching
from tests import models


def imported(folder: Path, source: Path, **options: str) -> tuple[RobotConfig, str]:
    """Import a model; return the robot loaded from the written TOML, and its text."""
    file = folder / "robot.toml"
    text = import_robot(source, file, **options).text
    file.write_text(text)
    return load_robot(file), text


@pytest.mark.parametrize(
    ("source", "joints", "tool", "held", "to_decide"),
    [
        (models.UR5E, 6, "attachment_site", set(), {"max_tracking_error", "velocities"}),
        (models.UR5E_URDF, 6, "tool0", set(), {"max_tracking_error"}),
        (models.PANDA, 7, "TCP", {"finger_joint1", "finger_joint2"}, {"max_tracking_error", "velocities"}),
        (models.IIWA14, 7, "TCP", set(), {"max_tracking_error", "velocities", "torques"}),
        (models.Z1, 6, "TCP", {"jointGripper"}, {"max_tracking_error", "velocities"}),
        (models.SO101_URDF, 5, "gripper_frame_link", {"gripper"}, {"max_tracking_error"}),
        (DEFAULT_ROBOT_CONFIG.with_suffix(".xml"), 6, "racket_centre", set(), {"max_tracking_error", "velocities"}),
        (
            models.XARM7,
            7,
            "ee",
            {"left_inner_knuckle_joint", "right_inner_knuckle_joint"},
            {"max_tracking_error", "velocities", "torques"},
        ),
    ],
    ids=lambda value: value.name if isinstance(value, Path) else None,
)
def test_arms_are_imported(
    tmp_path: Path, source: Path, joints: int, tool: str, held: set[str], to_decide: set[str]
) -> None:
    """Checks the chain to the tool, held gripper joints, a home without contact, and at most three open values."""
    robot, text = imported(tmp_path, source)
    assert robot.joint_count == joints
    assert (robot.tool.body or robot.tool.site) == tool
    assert set(robot.held) == held
    assert set(open_values(text)) == to_decide
    model = robot.load_model()
    data = mujoco.MjData(model)
    for name, value in {**dict(zip(robot.joint_names, robot.home, strict=True)), **robot.held}.items():
        data.qpos[model.jnt_qposadr[model.joint(name).id]] = value
    assert touching(model, data, {model.joint(name).id for name in robot.joint_names}) == {}
    unusable = [finding.sentence for finding in check_robot(robot, model) if finding.level == "unusable"]
    assert all("weld" in sentence for sentence in unusable), "the xArm7 is welded to a mocap body"
    assert bool(unusable) == (source == models.XARM7)


def test_velocity_and_torque_limits_come_from_the_urdf(tmp_path: Path) -> None:
    """MuJoCo drops some of them; the TOML has their origin as comments."""
    robot, text = imported(tmp_path, models.UR5E_URDF)
    np.testing.assert_array_equal(robot.limits.velocities, np.pi)
    np.testing.assert_array_equal(robot.torques, [150, 150, 150, 28, 28, 28])
    assert "# file: velocity" in text
    assert "# derived: (torque - gravity) / inertia" in text


def test_derived_accelerations_are_reachable_with_the_torques(tmp_path: Path) -> None:
    """At home, for all joints at once in the worst combination of signs, against gravity."""
    robot, _ = imported(tmp_path, models.UR5E)
    model = robot.load_model()
    data = mujoco.MjData(model)
    data.qpos[:] = robot.home
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    assert (np.abs(inertia) @ robot.limits.accelerations + np.abs(data.qfrc_bias) < robot.torques).all()
    np.testing.assert_allclose(robot.limits.jerks * 0.03, robot.limits.accelerations, rtol=0.1)


def test_the_models_path_is_relative_below_the_toml_and_else_absolute(tmp_path: Path) -> None:
    for name in ("collision", "ur5e.urdf"):
        (tmp_path / name).symlink_to(models.UR5E_URDF.parent / name)
    beside = import_robot(tmp_path / "ur5e.urdf", tmp_path / "my.toml").text
    assert 'model = "ur5e.urdf"' in beside
    for out in (None, tmp_path / "elsewhere" / "my.toml"):
        assert f'model = "{tmp_path / "ur5e.urdf"}"' in import_robot(tmp_path / "ur5e.urdf", out).text


SLIDER = """<mujoco><worldbody><body name="arm"><joint name="j" type="slide"/><geom size=".1"/></body></worldbody>
<keyframe><key name="home" qpos="{qpos}"/></keyframe></mujoco>"""


def test_tool_and_name_are_options(tmp_path: Path) -> None:
    robot, _ = imported(tmp_path, models.TWO_PANDAS, tool="panda1_TCP", name="right")
    assert robot.name == "right"
    assert robot.joint_names[0] == "panda1_joint1"
    assert "panda_joint4" in robot.held
    assert robot.held["panda_joint4"] == pytest.approx(-2.35619, abs=1e-4)
    for option, sentence in (("tool", "no such site or body"), ("keyframe", "it has panda_home")):
        with pytest.raises(RobotError, match=sentence):
            import_robot(models.TWO_PANDAS, None, **{option: "absent"})


def ur5e_urdf(folder: Path, old: str, new: str) -> Path:
    """Write the URDF of the UR5e with one text replaced, next to its meshes, and return its path."""
    text = models.UR5E_URDF.read_text()
    assert old in text
    file = folder / "ur5e.urdf"
    file.write_text(text.replace(old, new))
    if not (folder / "collision").exists():
        (folder / "collision").symlink_to(models.UR5E_URDF.parent / "collision")
    return file


def test_package_urls_of_meshes_are_resolved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the URDF's parent directories or ROS_PACKAGE_PATH; if neither has the package, the refusal names both."""
    folder = tmp_path / "ur_description" / "urdf"
    folder.mkdir(parents=True)
    file = ur5e_urdf(folder, "collision/", "package://ur_description/meshes/")
    with pytest.raises(RobotError, match=r"package://ur_description/meshes/shoulder.obj is missing.*ROS_PACKAGE_PATH"):
        import_robot(file, None)
    meshes = tmp_path / "ros" / "ur_description" / "meshes"
    meshes.parent.mkdir(parents=True)
    meshes.symlink_to(models.UR5E_URDF.parent / "collision")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ros"))
    assert "tool0" in import_robot(file, None).text
    monkeypatch.delenv("ROS_PACKAGE_PATH")
    (folder.parent / "meshes").symlink_to(meshes)
    assert "tool0" in import_robot(file, None).text


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('<?xml version="1.0" ?>', '<!DOCTYPE robot [<!ENTITY a "b">]>', "remove <!DOCTYPE>"),
        ("<robot", '<xacro:include filename="a"/><robot', "is not XML.*; correct the file there, or export it again"),
        ('<link name="base_link"/>', '<link name="base_link"/><xacro:arm/>', "expand it first"),
        ("collision/shoulder.obj", "collision/shoulder.dae", "convert it"),
        ("collision/shoulder.obj", "meshes/shoulder.obj", "it is looked for at"),
        ('effort="150.0"', 'effort="strong"', "is not a number; write a number"),
        ('effort="150.0"', 'effort="${effort}"', "is not a number; expand it first: xacro FILE.xacro > FILE.urdf"),
        ('lower="-3.141592653589793" upper="3.141592653589793"', 'upper="-1"', "begins at 0 and ends at -1; exchange"),
        ("</robot>", '<joint name="j" type="fixed"><mimic joint="elbow"/></joint></robot>', "j follows elbow, which"),
        ('<mass value="8.393"/>', '<mass value="0"/>', "give each link a mass and an inertia"),
    ],
)
def test_an_unreadable_urdf_is_refused_in_one_sentence(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    with pytest.raises(RobotError, match=sentence) as caught:
        import_robot(ur5e_urdf(tmp_path, old, new), None)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("arm.xml", "<?xml version='1.0'?><!-- <mujoco> --><robot name='arm'/>", "is a URDF.*; rename it to arm.urdf"),
        ("arm.urdf", "<mujoco/>", "its root is <mujoco>; .* an MJCF's name ends in .xml"),
        ("arm.urdf.xacro", "<robot/>", "is a xacro file; expand it first"),
        ("arm.xml", "", "empty file.*; export it again"),
        ("arm.xml", "<mujoco><worldbody>", "XML parse error.*; the file is not valid XML"),
        ("arm.xml", "<mujoco><wheel/></mujoco>", "; correct its name, or remove it"),
        ("arm.xml", "<mujoco><worldbody/></mujoco>", "the model has no joints; name the file of an arm"),
        ("arm.xml", SLIDER.format(qpos="0 0"), "invalid qpos size.*; write as many numbers as the model's joints have"),
        ("arm.xml", SLIDER.format(qpos="nan"), "keyframe 'home' has numbers that are not finite; correct them"),
        ("arm.xml", SLIDER.format(qpos="0").replace("size", "size='a' fromto"), "; [a-z]"),
    ],
)
def test_an_unreadable_model_is_refused_with_a_cure(tmp_path: Path, name: str, text: str, sentence: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(RobotError, match=sentence) as caught:
        import_robot(tmp_path / name, None)
    assert "\n" not in str(caught.value)


def test_a_name_that_no_key_can_have_is_refused_before_the_file_is_written() -> None:
    with pytest.raises(RobotError, match=r"--name: 'my arm/#' cannot be a part of a key"):
        import_robot(models.Z1, None, name="my arm/#")


LINK = """<link name="{0}"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><sphere radius="0.1"/></geometry></collision></link>"""
JOINT = """<joint name="{1}_joint" type="{2}"><parent link="{0}"/><child link="{1}"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="99" velocity="6.283185307179586"/></joint>"""


@pytest.mark.parametrize("hand", ["panda_hand", "last_link"])
def test_a_hand_becomes_the_tool_and_the_remedy_for_overlaps_suits_a_urdf(tmp_path: Path, hand: str) -> None:
    """The finger does not become the tool, velocity limits are not rounded up, and <exclude> is not proposed."""
    links = "".join(LINK.format(name) for name in ("base", "arm", hand, "panda_rightfinger"))
    chain = (("base", "arm", "revolute"), ("arm", hand, "revolute"), (hand, "panda_rightfinger", "prismatic"))
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(f'<robot name="r">{links}{"".join(JOINT.format(*joint) for joint in chain)}</robot>')
    robot, _ = imported(tmp_path, urdf)
    assert robot.tool.body == hand
    assert robot.joint_names == ("arm_joint", f"{hand}_joint")
    np.testing.assert_array_equal(robot.limits.velocities, 6.283185307179586)
    (overlap, *_) = (finding.sentence for finding in check_robot(robot, robot.model) if "overlap" in finding.sentence)
    assert overlap.endswith("change home, or where they always overlap, remove one <collision>")


def test_meshes_are_found_by_file_name_next_to_the_urdf(tmp_path: Path) -> None:
    """URDFs for MuJoCo refer to them that way."""
    file = ur5e_urdf(tmp_path, "collision/", "../../elsewhere/")
    for mesh in (models.UR5E_URDF.parent / "collision").iterdir():
        (tmp_path / mesh.name).symlink_to(mesh)
    assert "tool0" in import_robot(file, None).text
