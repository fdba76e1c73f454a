"""Findings of `volley robot check` in descriptions and models."""

from pathlib import Path

import pytest

from robot.checking.checks import Cost, check_robot, cost_finding, measure_cost
from robot.checking.subject import Finding
from robot.description import load_robot

MODEL = """
<mujoco>
  <compiler angle="{angle}"/>
  <asset><hfield name="hills" nrow="4" ncol="4" size="1 1 .1 .1"/></asset>
  <worldbody>
    {ground}
    <body name="base">
      <geom size=".05" pos="0 0 -.2"/>
      <body name="{upper}">
        <joint name="a" axis="0 1 0" range="-2 2" {first}/>
        <geom type="capsule" size=".03" fromto=".1 0 0 .4 0 0" mass="{mass}" {shape}/>
        <body name="lower" pos=".5 0 0">
          <joint name="b" axis="0 1 0" range="{second}" actuatorfrcrange="-9 9"/>
          <geom type="capsule" size=".03" fromto=".1 0 0 .4 0 0" mass=".5" {shape}/>
          <site name="tip" pos=".5 0 0"/>
          <body name="finger" pos=".5 0 0">
            <joint name="{finger}" type="slide" axis="0 1 0" range="0 .04"/>
            <geom size=".01" mass=".05" {shape} {tip}/>
          </body>
        </body>
      </body>
    </body>
    <body name="post" mocap="true" pos="{post} 0 0"><geom size=".05"/></body>
  </worldbody>
  <equality>{equality}</equality>
</mujoco>
"""
SOUND = {
    "angle": "radian",
    "upper": "upper",
    "first": 'actuatorfrcrange="-30 30"',
    "second": "-2.5 2.5",
    "mass": "1",
    "shape": "",
    "tip": "",
    "ground": "",
    "post": "3",
    "finger": "f",
    "equality": "",
}
TOML = """
name = "two"
model = "two.xml"
tool = "tip"
rate_hz = {rate_hz}
alpha = {alpha}
silence_ticks = 20
max_tracking_error = 0.1
[joints]
names = {names}
home = {home}
velocities = {velocities}
accelerations = [3.0, 4.0]
jerks = [50.0, 60.0]
[held]
{held}
[collision]
margin = {margin}
"""
DESCRIPTION = {
    "rate_hz": "1000",
    "alpha": "50.0",
    "names": '["a", "b"]',
    "home": "[0.1, 0.2]",
    "velocities": "[1.0, 2.0]",
    "held": "f = 0.0",
    "margin": "0.01",
}


def findings(folder: Path, **changes: str) -> list[Finding]:
    """Write the sound robot with changes of its model and TOML, and return the findings."""
    (folder / "two.xml").write_text(MODEL.format(**{key: changes.get(key, value) for key, value in SOUND.items()}))
    file = folder / "two.toml"
    file.write_text(TOML.format(**{key: changes.get(key, value) for key, value in DESCRIPTION.items()}))
    robot = load_robot(file)
    return check_robot(robot, robot.load_model())


def test_a_sound_robot_has_no_findings(tmp_path: Path) -> None:
    assert findings(tmp_path) == []


@pytest.mark.parametrize(
    ("changes", "level", "sentence"),
    [
        ({"post": ".3"}, "unusable", "at home post and upper overlap by"),
        ({"equality": '<weld body1="post" body2="lower"/>'}, "unusable", "a weld of post to lower works against a, b"),
        (
            {"equality": '<connect body1="base" body2="lower" anchor="0 0 0"/>'},
            "unusable",
            "a connect of base to lower",
        ),
        ({"equality": '<joint joint1="b" joint2="a"/>'}, "unusable", "couples a, b to"),
        ({"held": ""}, "warning", "nobody drives or holds f: they hang limp; add them to [held], as f = 0.0"),
        ({"held": "", "finger": ""}, "warning", "holds a joint of finger: they hang limp; name them in the model, and"),
        ({"names": '["b", "a"]'}, "warning", "b stands before a, which carries it"),
        ({"upper": ""}, "warning", "1 bodies of the arm have no name (body 2)"),
        (
            {"shape": 'contype="0" conaffinity="0"'},
            "warning",
            "no link of the arm has collision geometry: upper, lower, fi",
        ),
        ({"tip": 'contype="0" conaffinity="0"'}, "warning", "links without collision geometry: finger; their contacts"),
        (
            {"ground": '<geom name="soil" type="hfield" hfield="hills" pos="0 0 -2"/>'},
            "warning",
            "plans are not checked against the height or distance field of soil",
        ),
        ({"margin": "10"}, "warning", "nearer than 10 m at home, so no plan is checked for them: "),
        ({"mass": "40"}, "unusable", "a cannot hold the arm at home: gravity takes"),
        ({"mass": "9.5"}, "warning", "a hardly holds the arm at home"),
        ({"first": 'actuatorfrcrange="-30 30" frictionloss=".5"'}, "note", "a rubs with 0.5 N·m, 1.7% of its torque"),
        (
            {"first": 'actuatorfrcrange="-30 30" frictionloss="15"'},
            "warning",
            "a rubs with 15 N·m, 50.0% of its torque",
        ),
        ({"alpha": "800.0"}, "warning", "alpha of 800 is 0.8 a tick, so that a push rings; write at most 500"),
        ({"first": ""}, "warning", "no torque limit of a is known"),
        ({"velocities": "[inf, inf]"}, "warning", "no velocity limit of any joint is known"),
        ({"velocities": "[1.0, inf]"}, "warning", "no velocity limit of b is known"),
        ({"velocities": "[1.0, 180.0]"}, "warning", "b: a velocity limit of 180 looks like degrees; 3.14 rad/s"),
        ({"second": "-150 150"}, "warning", "b: its range of -150 to 150 rad looks like degrees"),
        ({"second": "2.5 -2.5"}, "warning", "b: its range begins at 2.5 and ends at -2.5"),
        (
            {"second": "-.05 .05", "home": "[0.1, 0.0]"},
            "warning",
            "b: a range narrower than 0.2 rad looks like radians",
        ),
    ],
)
def test_mistakes_are_found(tmp_path: Path, changes: dict[str, str], level: str, sentence: str) -> None:
    found = findings(tmp_path, **changes)
    assert any(finding.level == level and sentence in finding.sentence for finding in found), found


def test_a_contact_without_overlap_at_home_is_no_finding(tmp_path: Path) -> None:
    assert findings(tmp_path, post="0.479999999", home="[0.0, 0.0]") == []


def test_radians_read_as_degrees_are_found(tmp_path: Path) -> None:
    (found,) = findings(tmp_path, angle="degree", home="[0.01, 0.02]")
    assert found.level == "unusable"
    assert 'radians were read as degrees; write <compiler angle="radian"/>' in found.sentence


def test_several_joints_on_one_body_are_in_order_as_in_the_model(tmp_path: Path) -> None:
    slides = '<joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>'
    (tmp_path / "cart.xml").write_text(
        f'<mujoco><worldbody><body name="cart">{slides}<geom size=".1"/><site name="tip"/></body></worldbody></mujoco>'
    )
    for names, wrong in ((["x", "y"], 0), (["y", "x"], 1)):
        file = tmp_path / "cart.toml"
        description = TOML.replace("two.xml", "cart.xml").replace("[held]\n{held}", "")
        file.write_text(description.format(**{**DESCRIPTION, "names": str(names), "home": "[0.0, 0.0]"}))
        robot = load_robot(file)
        found = [one for one in check_robot(robot, robot.load_model()) if one.sentence.startswith("joints.names")]
        assert len(found) == wrong, found


def test_an_equality_of_a_gripper_joint_is_no_finding(tmp_path: Path) -> None:
    assert findings(tmp_path, equality='<joint joint1="f" polycoef="0 0 0 0 0"/>') == []


def test_time_and_memory_of_the_model_are_measured(tmp_path: Path) -> None:
    assert findings(tmp_path) == []
    robot = load_robot(tmp_path / "two.toml")
    cost = measure_cost(robot, robot.load_model())
    assert 0 < cost.step_s < 1e-3
    assert 0 < cost.model_bytes < cost.peak_bytes
    assert cost_finding(robot, cost).level == "note"
    assert cost_finding(robot, Cost(1, 1, 0.8e-3)).level == "warning"
