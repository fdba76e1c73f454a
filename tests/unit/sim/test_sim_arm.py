"""The simulated arm: tracking, torques, disturbances, noise, determinism, and refusals."""

from typing import Literal

import numpy as np
import pytest
from setpoints import accelerating

from motion.tracking import tracking_acceleration
from protocol.errors import Refusal
from protocol.messages import Ball, Disturb
from robot.description import load_robot
from services.sim.arm import Diverged, SimulatedArm

ROBOT = load_robot()
FAR_BALL = Ball(position=(3.0, 3.0, 1.0))
TICK = ROBOT.tick


def strike(time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a quintic from 0.05 s on that peaks on joint_1 at 13.5 rad/s, 243 rad/s² and 14,800 rad/s³."""
    duration, travel = 0.171, np.array([1.23, 0.12, 0.12, -0.12, 0.12, 0.12])
    s = np.clip((time - 0.05) / duration, 0, 1)
    positions = 10 * s**3 - 15 * s**4 + 6 * s**5
    velocities = (30 * s**2 - 60 * s**3 + 30 * s**4) / duration
    accelerations = (60 * s - 180 * s**2 + 120 * s**3) / duration**2
    start = np.array([-0.6, 0.52, 0.82, -0.2, 0, 0.09])
    return start + positions * travel, velocities * travel, accelerations * travel


def hold(arm: SimulatedArm, pose: np.ndarray, ticks: int) -> np.ndarray:
    """Track a constant pose; return the true positions after each tick, (ticks, J)."""
    rest = np.zeros_like(pose)
    path = []
    for _ in range(ticks):
        seen = arm.observe()
        arm.step(accelerating(tracking_acceleration(ROBOT.alpha, (pose, rest, rest), seen.positions, seen.velocities)))
        path.append(arm.observe().true_positions)
    return np.array(path)


@pytest.mark.parametrize(
    ("mean_acceleration", "position_error", "velocity_error"), [(True, 5e-5, 5e-3), (False, 3e-3, 0.13)]
)
def test_a_fast_strike_is_tracked(mean_acceleration: bool, position_error: float, velocity_error: float):
    """With each tick's mean acceleration the error is small; with the value at its start it is half a tick of lag."""
    arm = SimulatedArm(ROBOT)
    arm.reset(positions=strike(0)[0].tolist(), ball=FAR_BALL)
    for tick in range(300):
        seen = arm.observe()
        positions, velocities, accelerations = strike(seen.time)
        assert seen.tick == tick
        assert seen.time == tick / ROBOT.rate_hz
        assert np.abs(seen.positions - positions).max() < position_error
        assert np.abs(seen.velocities - velocities).max() < velocity_error
        assert not seen.saturated.any()
        if mean_acceleration:
            accelerations = (strike(seen.time + TICK)[1] - velocities) / TICK
        reference = (positions, velocities, accelerations)
        arm.step(accelerating(tracking_acceleration(ROBOT.alpha, reference, seen.positions, seen.velocities)))


def test_commanded_accelerations_are_realised_exactly():
    """After one tick from rest the position has changed by a·t²/2 and the velocity by a·t; gravity is compensated."""
    arm = SimulatedArm(ROBOT)
    command = np.array([100.0, -50, 80, 200, -150, 90])
    arm.step(accelerating(command))
    seen = arm.observe()
    np.testing.assert_allclose(seen.velocities, command * TICK, rtol=1e-9)
    np.testing.assert_allclose(seen.positions - ROBOT.home, command * TICK**2 / 2, rtol=1e-9, atol=1e-15)


def test_torques_are_clipped_and_reported_as_saturated():
    arm = SimulatedArm(ROBOT)
    command = np.zeros(6)
    command[0] = 1e4
    arm.step(accelerating(command))
    seen = arm.observe()
    assert seen.saturated[0]
    assert seen.torques[0] == ROBOT.torques[0]
    assert 0 < seen.velocities[0] < 1e4 * TICK / 2


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_command_that_is_not_finite_is_refused_and_moves_nothing(value: float):
    arm = SimulatedArm(ROBOT)
    before = arm.observe()
    command = np.zeros(6)
    command[3] = value
    with pytest.raises(ValueError, match="must be finite"):
        arm.step(accelerating(command))
    assert arm.observe() is before
    arm.step(accelerating(np.zeros(6)))
    assert arm.observe().tick == 1
    assert np.isfinite(arm.observe().positions).all()


@pytest.mark.parametrize("alpha", [15.0, 50.0])
def test_the_papers_push_deflects_a_joint_as_predicted(alpha: float):
    """100 rad/s² for 0.2 s deflect it by 400/α² (1 − (1 + x)e⁻ˣ), x = α·0.2/2: 0.16 rad without a fault at α = 50."""
    arm = SimulatedArm(ROBOT)
    arm.reset(ball=FAR_BALL)
    values = [100.0, 0, 0, 0, 0, 0]
    begins = arm.disturb(Disturb(kind="acceleration", values=values, start_time=0.01, duration=0.2))
    assert begins == 0.01
    rest = np.zeros(6)
    deflections = []
    for _ in range(300):
        seen = arm.observe()
        command = tracking_acceleration(alpha, (ROBOT.home, rest, rest), seen.positions, seen.velocities)
        arm.step(accelerating(command))
        deflections.append(arm.observe().positions - ROBOT.home)
    deflections = np.array(deflections)
    x = alpha * 0.2 / 2
    expected = 400 / alpha**2 * (1 - (1 + x) * np.exp(-x))
    assert deflections[209, 0] == pytest.approx(expected, rel=0.03)
    assert np.abs(deflections[:10]).max() < 1e-9
    assert np.abs(deflections[:, 1:]).max() < 0.05 * expected
    if alpha == ROBOT.alpha:
        assert np.abs(deflections).max() < ROBOT.max_tracking_error


def test_a_torque_disturbance_acts_for_its_duration_and_is_not_measured():
    arm = SimulatedArm(ROBOT)
    arm.disturb(Disturb(kind="torque", values=[0, 0, 0, 0, 0, 1.0], duration=0.001))
    pushed = arm.disturbances()
    assert [(push.kind, push.values, push.end_time) for push in pushed] == [("torque", [0, 0, 0, 0, 0, 1.0], 0.001)]
    arm.step(accelerating(np.zeros(6)))
    assert arm.disturbances() == []
    assert arm.observe().velocities[5] > 0.01
    assert not arm.observe().torques[0] > 1, "the disturbance is not measured as motor torque"


def test_sensor_noise_affects_only_measured_values():
    arm = SimulatedArm(ROBOT)
    arm.disturb(Disturb(kind="sensor_noise", position_std=0.01, velocity_std=0.1))
    assert [active.kind for active in arm.disturbances()] == ["sensor_noise"]
    errors = []
    for _ in range(2000):
        arm.step(accelerating(np.zeros(6)))
        seen = arm.observe()
        errors.append([seen.positions - seen.true_positions, seen.velocities - seen.true_velocities])
    deviations = np.std(errors, axis=0)
    np.testing.assert_allclose(deviations[0], 0.01, rtol=0.1)
    np.testing.assert_allclose(deviations[1], 0.1, rtol=0.1)
    assert np.abs(arm.observe().true_positions - ROBOT.home).max() < 1e-6
    arm.disturb(Disturb(kind="sensor_noise", position_std=0.0, velocity_std=0.0))
    assert arm.disturbances() == []
    arm.step(accelerating(np.zeros(6)))
    np.testing.assert_array_equal(arm.observe().positions, arm.observe().true_positions)


def test_the_simulation_is_deterministic_to_the_bit():
    def bits(arm: SimulatedArm, seed: int) -> bytes:
        arm.reset(seed=seed)
        arm.disturb(Disturb(kind="sensor_noise", position_std=0.01, velocity_std=0.1))
        arm.disturb(Disturb(kind="acceleration", values=[50.0] * 6, duration=0.05))
        trail = b""
        for _ in range(200):
            seen = arm.observe()
            rest = np.zeros(6)
            arm.step(accelerating(tracking_acceleration(50, (ROBOT.home, rest, rest), seen.positions, seen.velocities)))
            seen = arm.observe()
            assert seen.true_velocities is not None
            trail += seen.positions.tobytes() + seen.true_velocities.tobytes() + seen.torques.tobytes()
        return trail

    arm = SimulatedArm(ROBOT)
    first = bits(arm, 7)
    assert bits(SimulatedArm(ROBOT, seed=1), 7) == first
    assert bits(arm, 7) == first, "a reset restores the initial state"
    assert bits(arm, 8) != first


def test_reset_places_arm_ball_and_tee():
    arm = SimulatedArm(ROBOT)
    arm.step(accelerating(np.full(6, 10.0)))
    pose = [0.5, 0.1, 0.2, 0.3, 0.4, 0.5]
    arm.reset(positions=pose, ball=Ball(position=(0.4, -0.8, 0.9)))
    assert arm.observe().tick == 0
    assert arm.observe().positions.tolist() == pose
    assert not arm.observe().velocities.any()
    hold(arm, np.array(pose), 500)
    ball = arm.ball() or pytest.fail("there is a ball")
    np.testing.assert_allclose(ball.position, [0.4, -0.8, 0.9], atol=1e-4)
    np.testing.assert_allclose(ball.velocity, 0, atol=1e-2)
    assert arm.contacts() == []


def test_a_ball_with_a_velocity_flies_without_a_tee():
    arm = SimulatedArm(ROBOT)
    arm.reset(ball=Ball(position=(2.0, 2.0, 1.0), velocity=(1.0, 0.0, 0.0)))
    hold(arm, ROBOT.home, 100)
    ball = arm.ball() or pytest.fail("there is a ball")
    np.testing.assert_allclose(ball.position, [2.1, 2.0, 1 - 9.81 * 0.01 / 2], atol=1e-3)
    np.testing.assert_allclose(ball.velocity, [1, 0, -0.981], atol=5e-3)


def test_an_arm_without_held_joints_accepts_only_an_empty_hold():
    arm = SimulatedArm(ROBOT)
    arm.hold({})
    with pytest.raises(Refusal):
        arm.hold({"finger": 0.0})


def test_joint_ranges_are_hard_stops():
    arm = SimulatedArm(ROBOT)
    arm.reset(positions=[2.1, 0.5, 0.8, 0, 0, 0], ball=FAR_BALL)
    for _ in range(500):
        arm.step(accelerating(np.array([40.0, 0, 0, 0, 0, 0])))
    assert abs(arm.observe().positions[0] - ROBOT.limits.positions[0, 1]) < 0.02


@pytest.mark.parametrize(
    ("positions", "ball", "code", "sentence"),
    [
        ([0.0] * 5, None, "bad_message", "positions has 5 numbers; the arm has 6 joints"),
        ([0.0, 0, 0, np.nan, 0, 0], None, "bad_message", "joint_4 is nan"),
        ([2.5, 0.0, 0, 0, 0, 0], None, "limit", "joint_1 at 2.5 rad lies outside its range -2.2 to 2.2"),
        (None, Ball(position=(0.0, np.inf, 0.0)), "bad_message", "it must lie within 100 (m, m/s) of 0"),
    ],
)
def test_a_refused_reset_changes_nothing(positions: list[float] | None, ball: Ball | None, code: str, sentence: str):
    arm = SimulatedArm(ROBOT)
    arm.step(accelerating(np.ones(6)))
    before = arm.observe()
    with pytest.raises(Refusal) as raised:
        arm.reset(positions=positions, ball=ball)
    assert raised.value.code == code
    assert sentence in raised.value.message
    assert arm.observe() is before


@pytest.mark.parametrize(
    ("request_", "field", "sentence"),
    [
        (Disturb(kind="torque", duration=1.0), "values", "values is missing"),
        (Disturb(kind="torque", values=[0.0] * 6), "duration", "duration is missing"),
        (Disturb(kind="torque", values=[0.0], duration=1.0), "values", "values has 1 numbers; the arm has 6"),
        (Disturb(kind="torque", values=[np.nan] * 6, duration=1.0), "values", "joint_1 is nan"),
        (Disturb(kind="torque", values=[0.0] * 6, duration=0.0), "duration", "duration is 0.0 s"),
        (Disturb(kind="torque", values=[0.0] * 6, duration=1.0, start_time=-1.0), "start_time", "or null"),
        (Disturb(kind="torque", values=[0.0] * 6, duration=1.0, start_time=np.nan), "start_time", "or null"),
        (Disturb(kind="sensor_noise", position_std=-1.0), "position_std", "position_std is -1.0"),
        (Disturb(kind="sensor_noise", velocity_std=np.inf), "velocity_std", "velocity_std is inf"),
        (Disturb(kind="sensor_noise", position_std=0.1, duration=1.0), "duration", "belongs to another kind"),
        (Disturb(kind="torque", values=[0.0] * 6, duration=1.0, latency_s=0.1), "latency_s", "belongs to another kind"),
    ],
)
def test_a_refused_disturbance_has_no_effect(request_: Disturb, field: str, sentence: str):
    arm = SimulatedArm(ROBOT)
    with pytest.raises(Refusal) as raised:
        arm.disturb(request_)
    assert raised.value.code == "bad_message"
    assert raised.value.detail == {"field": field}
    assert sentence in raised.value.message
    assert arm.disturbances() == []


@pytest.mark.parametrize("kind", ["acceleration", "torque"])
def test_the_strongest_accepted_disturbance_keeps_the_simulation_finite(kind: Literal["acceleration", "torque"]):
    """Ten times the limits, on all joints, until every joint is at the end of its range."""
    arm = SimulatedArm(ROBOT)
    limits = ROBOT.limits.accelerations if kind == "acceleration" else ROBOT.torques
    arm.disturb(Disturb(kind=kind, values=(10 * limits).tolist(), duration=0.5))
    for _ in range(1000):
        arm.step(accelerating(np.zeros(6)))
    assert np.isfinite(arm.observe().positions).all()


def test_a_diverging_simulation_raises_an_error():
    arm = SimulatedArm(ROBOT)
    strong = Disturb(kind="torque", values=(10 * ROBOT.torques).tolist(), duration=10.0)
    for _ in range(64):
        arm.disturb(strong)
    with pytest.raises(Diverged, match="diverged at"):
        for _ in range(2000):
            arm.step(accelerating(np.zeros(6)))


def test_the_number_of_pending_disturbances_is_bounded():
    arm = SimulatedArm(ROBOT)
    push = Disturb(kind="torque", values=[0.0] * 6, start_time=100.0, duration=1.0)
    with pytest.raises(Refusal, match="disturbances act or wait"):
        for _ in range(1000):
            arm.disturb(push)


@pytest.mark.parametrize(("kind", "unit"), [("acceleration", "rad/s²"), ("torque", "N·m")])
def test_a_push_that_is_too_strong_is_refused_with_its_unit(kind: Literal["acceleration", "torque"], unit: str):
    with pytest.raises(Refusal, match=rf"joint_1 is 1e\+09 {unit}; it must lie between -\d+ and \d+ {unit}"):
        SimulatedArm(ROBOT).disturb(Disturb(kind=kind, values=[1e9, 0, 0, 0, 0, 0], duration=0.1))
