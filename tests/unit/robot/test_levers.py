"""Bounds on the approach speed of bodies for arms with prismatic joints, which change the lever arms."""

from pathlib import Path

import numpy as np
import pytest

from robot.description import RobotConfig, load_robot
from robot.motion_check import Collides, MotionCheck
from tests.unit.robot.small_arm import straight

MODEL = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 .1"/>
    <body name="turn" pos="0 0 .5">
      <joint name="tilt" axis="0 1 0" range="-2 2"/>
      <geom size=".05" mass="1"/>
      <body name="rod">
        <joint name="out" type="slide" axis="1 0 0" {slide}/>
        <geom size=".03" pos=".3 0 0" mass=".2"/>
        <site name="tip" pos=".3 0 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
TOML = """
name = "polar"
model = "polar.xml"
tool = "tip"
rate_hz = 1000
alpha = 50.0
silence_ticks = 20
max_tracking_error = 0.1
[joints]
names = ["tilt", "out"]
home = [0.0, {home}]
velocities = [2.0, 2.0]
accelerations = [20.0, 20.0]
jerks = [500.0, 500.0]
"""


def polar(folder: Path, slide: str, home: float = 0.0) -> RobotConfig:
    """Return an arm with a hinge and a slide; `slide`: attributes of the slide."""
    (folder / "polar.xml").write_text(MODEL.format(slide=slide))
    (folder / "polar.toml").write_text(TOML.format(home=home))
    return load_robot(folder / "polar.toml")


@pytest.mark.parametrize("slide", ['range="0 1"', ""], ids=["limited", "unlimited"])
@pytest.mark.parametrize(
    ("start", "end"), [([1.2, 0.0], [1.2, 0.9]), ([0.0, 0.9], [1.2, 0.9])], ids=["reaching out", "tilting"]
)
def test_collisions_of_a_body_on_a_slide_with_a_plane_are_found(
    tmp_path: Path, slide: str, start: list[float], end: list[float]
):
    check = MotionCheck(polar(tmp_path, slide))
    with pytest.raises(Collides, match="deep into floor"):
        check.check(straight(start, end), 1.0)
    assert check.check(straight([0.0, 0.0], [0.0, 0.9]), 1.0).nearest is not None


def test_lever_arms_account_for_the_slides_reference(tmp_path: Path):
    """At `ref` bodies are at their poses in the model; the distance from `ref` lengthens the lever."""
    levers = [
        MotionCheck(polar(tmp_path, slide, home)).clearance.rates.max()
        for slide, home in (('range="0 1"', 0.0), ('range="5 6" ref="5"', 5.0), ('range="0 1" ref="5"', 0.0))
    ]
    np.testing.assert_allclose(np.subtract(levers, levers[0]), [0.0, 0.0, 4.0])
