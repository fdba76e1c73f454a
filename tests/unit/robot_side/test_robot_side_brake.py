"""The arm's own brake: it stops within the acceleration limits from any state, holds, and is released at rest."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from setpoints import accelerating

from protocol.messages import Ball, Disturb
from robot.description import load_robot
from services.common.robot_side.brake import RELEASE_DISTANCE, Brake
from services.sim.arm import SimulatedArm

ROBOT = load_robot()
POSE = np.array([0.1, 0.4, 0.8, 0.0, 0.2, 0.0])
REST = np.zeros(6)


def simulate(brake: Brake, positions: np.ndarray, velocities: np.ndarray, ticks: int) -> np.ndarray:
    """Integrate the brake's commands exactly; return positions, velocities and accelerations (3, ticks, J)."""
    path = []
    for _ in range(ticks):
        command = brake.setpoint(positions, velocities).accelerations
        positions = positions + velocities * ROBOT.tick + command * ROBOT.tick**2 / 2
        velocities = velocities + command * ROBOT.tick
        path.append((positions, velocities, command))
    return np.array(path).transpose(1, 0, 2)


fraction = st.floats(-1, 1)


@settings(max_examples=50, deadline=None)
@given(st.lists(fraction, min_size=6, max_size=6), st.lists(fraction, min_size=6, max_size=6))
def test_the_brake_stops_from_any_motion_and_holds(
    velocity_fractions: list[float], acceleration_fractions: list[float]
):
    brake = Brake(ROBOT, POSE)
    velocities = np.array(velocity_fractions) * ROBOT.limits.velocities
    brake.engage(POSE, velocities, np.array(acceleration_fractions) * ROBOT.limits.accelerations)
    positions, speeds, commands = simulate(brake, POSE, velocities, 400)
    assert brake.at_rest
    assert np.abs(speeds[-1]).max() < 1e-4
    assert np.abs(positions[-1] - positions[-50]).max() < 1e-5
    # 10 % more: the tracking law also corrects the error of constant accelerations in ticks in which the jerk steps.
    assert (np.abs(commands) < 1.1 * ROBOT.limits.accelerations + 1).all()


def test_an_initial_acceleration_beyond_the_limits_is_clipped():
    brake = Brake(ROBOT, POSE)
    brake.engage(POSE, REST, np.full(6, 1e6))
    _, speeds, commands = simulate(brake, POSE, REST, 400)
    assert (np.abs(commands[:5]) <= 1.01 * ROBOT.limits.accelerations).all()
    assert np.abs(speeds[-1]).max() < 1e-4


def test_the_brake_stops_the_simulated_arm_during_a_strike():
    arm = SimulatedArm(ROBOT)
    arm.reset(positions=POSE.tolist(), ball=Ball(position=(3.0, 3.0, 1.0)))
    last = np.array([100.0, 0, 0, 0, 0, -50])
    for _ in range(80):
        arm.step(accelerating(last))
    brake = Brake(ROBOT, POSE)
    seen = arm.observe()
    assert seen.velocities[0] > 7
    brake.engage(seen.positions, seen.velocities, last)
    for _ in range(400):
        seen = arm.observe()
        arm.step(brake.setpoint(seen.positions, seen.velocities))
    seen = arm.observe()
    assert np.abs(seen.velocities).max() < 1e-3
    assert brake.releases(seen.positions, REST)


def test_the_brake_holds_the_pose_under_sensor_noise():
    arm = SimulatedArm(ROBOT)
    arm.disturb(Disturb(kind="sensor_noise", position_std=0.001, velocity_std=0.01))
    brake = Brake(ROBOT, ROBOT.home)
    assert brake.at_rest
    for _ in range(500):
        seen = arm.observe()
        arm.step(brake.setpoint(seen.positions, seen.velocities))
    assert np.abs(arm.observe().true_positions - ROBOT.home).max() < 0.002


@pytest.mark.parametrize(
    ("offset", "velocity", "released"),
    [
        (0.0, 0.0, True),
        (0.9 * RELEASE_DISTANCE, 0.0, True),
        (1.1 * RELEASE_DISTANCE, 0.0, False),
        (-1.1 * RELEASE_DISTANCE, 0.0, False),
        (0.0, 0.01, False),
        (np.nan, 0.0, False),
        (0.0, np.nan, False),
    ],
)
def test_the_brake_is_released_only_for_a_reference_at_rest_nearby(offset: float, velocity: float, released: bool):
    brake = Brake(ROBOT, POSE)
    positions, velocities = POSE.copy(), REST.copy()
    positions[2] += offset
    velocities[4] = velocity
    assert brake.releases(positions, velocities) is released


def test_the_brake_is_not_released_while_it_stops():
    brake = Brake(ROBOT, POSE)
    velocities = np.full(6, 3.0)
    brake.engage(POSE, velocities, REST)
    end = simulate(brake, POSE, velocities, 400)[0, -1]
    brake.engage(POSE, velocities, REST)
    assert not brake.releases(end, REST)
    simulate(brake, POSE, velocities, 5)
    assert not brake.releases(end, REST)
    simulate(brake, POSE, velocities, 400)
    assert brake.releases(end, REST)
