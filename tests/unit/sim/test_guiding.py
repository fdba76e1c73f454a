"""A guided arm yields to pushes, stays inside its ranges, and follows setpoints again after recovery."""

import numpy as np
import pytest

from protocol import messages as m
from robot.description import load_robot
from services.common.robot_side.backend import Setpoint
from services.sim.arm import SimulatedArm

CONFIG = load_robot()


@pytest.fixture(scope="module")
def scene_arm() -> SimulatedArm:
    return SimulatedArm(CONFIG)


@pytest.fixture
def arm(scene_arm: SimulatedArm) -> SimulatedArm:
    scene_arm.reset()
    scene_arm.guide()
    return scene_arm


def follow(arm: SimulatedArm, ticks: int) -> np.ndarray:
    """Step the arm with setpoints at home; return its positions (ticks, J), rad."""
    still = np.zeros(CONFIG.joint_count)
    shown = []
    for _ in range(ticks):
        arm.step(Setpoint(still, CONFIG.home, still, still))
        shown.append(arm.observe().positions)
    return np.array(shown)


def push(arm: SimulatedArm, values: list[float], duration: float) -> None:
    arm.disturb(m.Disturb(kind="acceleration", values=values, duration=duration))


def test_a_guided_arm_reports_its_condition_and_does_not_fall(arm):
    assert (arm.observe().condition, arm.observe().reason) == ("guiding", "`guide` was requested")
    assert np.abs(follow(arm, 500) - CONFIG.home).max() < 1e-3


def test_a_push_moves_a_guided_arm_to_another_place(arm):
    push(arm, [2.0, 0, 0, 0, 0, 0], 0.3)
    shown = follow(arm, 3000)
    assert shown[-1, 0] - CONFIG.home[0] > 0.15
    assert np.abs(arm.observe().velocities).max() < 0.05
    assert np.abs(shown[:, 1:3] - CONFIG.home[1:3]).max() < 0.02


@pytest.mark.parametrize("joint", range(6))
def test_a_hard_push_does_not_move_a_joint_beyond_its_range(arm, joint):
    for sign in (1.0, -1.0):
        push(arm, [20.0 * sign if number == joint else 0.0 for number in range(6)], 1.0)
        shown = follow(arm, 1200)[:, joint]
        low, high = CONFIG.limits.positions[joint]
        assert low <= shown.min()
        assert shown.max() <= high
        assert np.abs(np.diff(shown)).max() * CONFIG.rate_hz < CONFIG.limits.velocities[joint]


@pytest.mark.parametrize("kind", ["acceleration", "torque"])
def test_the_strongest_pushes_do_not_move_joints_beyond_their_ranges(arm, kind):
    """On all joints for 0.6 s; some press the arm into the floor."""
    rng = np.random.default_rng(0)
    largest = 10 * (CONFIG.limits.accelerations if kind == "acceleration" else CONFIG.torques)
    low, high = CONFIG.limits.positions.T
    for _ in range(6):
        arm.reset()
        arm.guide()
        values = largest * rng.choice([-1.0, 1.0], CONFIG.joint_count)
        arm.disturb(m.Disturb(kind=kind, values=values.tolist(), duration=0.6))
        shown = follow(arm, 800)
        assert (low <= shown.min(axis=0)).all()
        assert (shown.max(axis=0) <= high).all()
        assert (np.abs(np.diff(shown, axis=0)) * CONFIG.rate_hz < CONFIG.limits.velocities).all()


def test_a_joint_at_the_end_of_its_range_stays_there(arm):
    """Guiding does not push it back from there, but a push can move it away."""
    pose = CONFIG.home.copy()
    pose[0] = CONFIG.limits.positions[0, 1]
    arm.reset(pose.tolist())
    arm.guide()
    assert np.abs(follow(arm, 300) - pose).max() < 1e-3
    push(arm, [-2.0, 0, 0, 0, 0, 0], 0.3)
    assert follow(arm, 1500)[-1, 0] < pose[0] - 0.1


def test_after_recovery_the_arm_follows_setpoints(arm):
    push(arm, [2.0, 0, 0, 0, 0, 0], 0.3)
    let_go = follow(arm, 3000)[-1]
    arm.recover()
    arm.begin_run()
    assert arm.observe().condition == "ready"
    assert np.array_equal(arm.observe().positions, let_go)
    before = arm.observe().velocities[0]
    still = np.zeros(6)
    arm.step(Setpoint(np.array([1.0, 0, 0, 0, 0, 0]), let_go, still, still))
    assert arm.observe().velocities[0] - before == pytest.approx(1e-3, rel=0.05)
