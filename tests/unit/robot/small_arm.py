"""A planar arm of two links next to a wall, with finger, ball and tee, whose distances can be computed by hand."""

from pathlib import Path

import numpy as np

from motion.trajectory import Trajectory
from robot.description import RobotConfig, load_robot

MODEL = """
<mujoco>
  <compiler angle="radian"/>
  <option gravity="0 0 -10"/>
  <worldbody>
    <geom name="wall" type="box" size="0.1 2 2" pos="2.0 0 0"/>
    <geom name="pedestal" type="sphere" size="0.06"/>
    <body name="upper">
      <joint name="shoulder" axis="0 0 1"/>
      <geom type="capsule" size="0.05" fromto="0 0 0 1 0 0" mass="1"/>
      <body name="lower" pos="1 0 0">
        <joint name="elbow" axis="0 0 1" range="-3.1 3.1" limited="true"/>
        <geom type="capsule" size="0.05" fromto="0 0 0 0.6 0 0" mass="1"/>
        <body name="hand" pos="0.7 0 0">
          <joint name="roll" axis="1 0 0"/>
          <geom type="sphere" size="0.04" mass="0.1"/>
          <body name="flange" pos="0.05 0 0">
            <site name="tip"/>
            <body name="finger">
              <joint name="grip" type="slide" axis="0 1 0" range="0 0.5"/>
              <geom type="sphere" size="0.02" pos="0.05 0 0" mass="0.01"/>
            </body>
          </body>
        </body>
      </body>
    </body>
    <body name="ball" pos="0.5 0.5 0"><freejoint/><geom type="sphere" size="0.2"/></body>
    <body name="tee" mocap="true" pos="0.5 -0.5 0"><geom type="sphere" size="0.2"/></body>
  </worldbody>
</mujoco>
"""


def small_arm(folder: Path, more: str = "", home: str = "[1.57, 0.0, 0.0]", model: str = MODEL) -> RobotConfig:
    """Write the model and its TOML, with `more` appended, and return the loaded arm."""
    (folder / "small.xml").write_text(model)
    file = folder / "small.toml"
    file.write_text(
        'name = "small"\nmodel = "small.xml"\ntool = "tip"\nrate_hz = 1000\nalpha = 50.0\nsilence_ticks = 20\n'
        f'max_tracking_error = 0.3\n[joints]\nnames = ["shoulder", "elbow", "roll"]\nhome = {home}\n'
        "velocities = [3, 3, 3]\naccelerations = [20, 20, 20]\njerks = [500, 500, 500]\n" + more
    )
    return load_robot(file)


def straight(start: np.ndarray | list[float], end: np.ndarray | list[float], duration: float = 1.0) -> Trajectory:
    """Return a motion from rest to rest on a line in joint space, rad."""
    begin, way = np.array(start), np.subtract(end, start)
    coefficients = np.zeros((1, len(begin), 6))
    coefficients[0, :, 0] = begin
    for power, factor in ((3, 10.0), (4, -15.0), (5, 6.0)):
        coefficients[0, :, power] = factor * way / duration**power
    return Trajectory(np.array([0.0, duration]), coefficients)
