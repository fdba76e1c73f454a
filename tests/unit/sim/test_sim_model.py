"""A robot other than the shipped one: position servos, damping, a coarse time step, no ball and no tee."""

from pathlib import Path

import numpy as np
import pytest
from setpoints import accelerating

from motion.tracking import tracking_acceleration
from protocol.errors import Refusal
from protocol.messages import Ball
from robot.description import RobotConfig, load_robot
from services.sim.arm import SimulatedArm
from services.sim.model import build_scene

MJCF = """
<mujoco>
  <option timestep="{timestep}" integrator="implicitfast"/>
  <worldbody>
    <body>
      <joint name="base" axis="0 0 1" damping="20" armature="0.1"/>
      <geom type="capsule" size="0.05" fromto="0 0 0 0.4 0 0" mass="3"/>
      <body pos="0.4 0 0">
        <joint name="elbow" axis="0 1 0" damping="0.5" armature="0.1"/>
        <geom type="capsule" size="0.04" fromto="0 0 0 0.3 0 0" mass="1"/>
        <site name="tip" pos="0.3 0 0"/>
        <body pos="0.3 0 0">
          <joint name="finger" axis="0 1 0" damping="0.5" stiffness="5" armature="0.01"/>
          <geom type="capsule" size="0.01" fromto="0 0 0 0.05 0 0" mass="0.05"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="base" kp="900" forcerange="-80 80"/>
    <position joint="elbow" kp="900" forcerange="-80 80"/>
  </actuator>
</mujoco>
"""

TOML = """
name = "other"
model = "other.xml"
tool = "tip"
rate_hz = 500
alpha = 50.0
silence_ticks = 20
max_tracking_error = 0.3
[joints]
names = ["elbow", "base"]
home = [0.3, 0.2]
velocities = [10.0, 10.0]
accelerations = [100.0, 100.0]
jerks = [5000.0, 5000.0]
"""


def other_robot(folder: Path, timestep: float) -> RobotConfig:
    (folder / "other.xml").write_text(MJCF.format(timestep=timestep))
    (folder / "other.toml").write_text(TOML)
    return load_robot(folder / "other.toml")


@pytest.mark.parametrize(
    ("timestep", "substeps", "step"), [(0.002, 1, 0.002), (0.01, 1, 0.002), (0.0015, 2, 0.001), (0.0005, 4, 0.0005)]
)
def test_a_tick_is_a_whole_number_of_physics_steps(tmp_path: Path, timestep: float, substeps: int, step: float):
    scene = build_scene(other_robot(tmp_path, timestep))
    assert scene.substeps == substeps
    assert scene.model.opt.timestep == pytest.approx(step)


@pytest.mark.parametrize(("timestep", "bound"), [(0.002, 5e-6), (0.0005, 2e-4)])
def test_joints_are_tracked_in_the_order_of_the_toml(tmp_path: Path, timestep: float, bound: float):
    """The model's servos are disabled, damping is compensated, and other joints move freely."""
    config = other_robot(tmp_path, timestep)
    arm = SimulatedArm(config)
    frequency, amplitude = 4.0, np.array([0.3, -0.2])

    def reference(time: float) -> tuple[np.ndarray, np.ndarray]:
        phase = frequency * time
        positions = config.home + amplitude * (phase - np.sin(phase))
        return positions, amplitude * frequency * (1 - np.cos(phase))

    for _ in range(500):
        seen = arm.observe()
        positions, velocities = reference(seen.time)
        assert np.abs(seen.positions - positions).max() < bound
        mean_acceleration = (reference(seen.time + config.tick)[1] - velocities) / config.tick
        target = (positions, velocities, mean_acceleration)
        arm.step(accelerating(tracking_acceleration(config.alpha, target, seen.positions, seen.velocities)))
    assert arm.observe().time == 1.0


def test_a_scene_without_a_ball_refuses_one_and_reports_no_contacts(tmp_path: Path):
    arm = SimulatedArm(other_robot(tmp_path, 0.002))
    assert arm.ball() is None
    with pytest.raises(Refusal, match="ball: this robot's scene has no ball; leave it null"):
        arm.reset(ball=Ball(position=(0.0, 0.0, 1.0)))
    arm.step(accelerating(np.zeros(2)))
    assert arm.contacts() == []
