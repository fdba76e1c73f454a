"""The simulated ball: flight, throws, and the simulated camera."""

from dataclasses import replace

import numpy as np
import pytest
from setpoints import accelerating

from protocol.errors import Refusal
from protocol.messages import BallState, Disturb, Throw
from robot.description import load_robot
from services.sim.arm import SimulatedArm
from services.sim.ball import TEE_STORE

ROBOT = load_robot()
assert ROBOT.ball is not None
BALL = ROBOT.ball
THROW = Throw(position=(2.0, 1.0, 2.0), velocity=(-6.0, 1.0, 3.0), spin=(20.0, -150.0, 40.0))


def fly(arm: SimulatedArm, ticks: int) -> list[BallState]:
    """Step the arm with zero accelerations; return the ball's sights."""
    seen = arm.sights()
    for _ in range(ticks):
        arm.step(accelerating(np.zeros(6)))
        seen += arm.sights()
    return seen


def test_the_flight_has_gravity_drag_and_magnus():
    """Each step adds the acceleration at its start to the velocity, and the new velocity to the position."""
    arm = SimulatedArm(ROBOT)
    assert arm.throw(THROW) == 0.0
    position, velocity, spin = (np.array(vector) for vector in (THROW.position, THROW.velocity, THROW.spin))
    for _ in range(500):
        drag = -BALL.drag * np.linalg.norm(velocity) * velocity
        velocity = velocity + (np.array([0, 0, -9.81]) + drag + BALL.magnus * np.cross(spin, velocity)) * ROBOT.tick
        position = position + velocity * ROBOT.tick
    fly(arm, 500)
    ball = arm.ball() or pytest.fail("there is a ball")
    np.testing.assert_allclose(ball.position, position, atol=1e-9)
    np.testing.assert_allclose(ball.velocity, velocity, atol=1e-9)
    np.testing.assert_allclose(ball.spin, spin, atol=1e-9)
    straight = np.array(THROW.position) + 0.5 * np.array(THROW.velocity) + [0, 0, -9.81 * 0.125]
    assert np.linalg.norm(position - straight) > 0.1, "drag and spin have an effect"


def test_a_throw_keeps_the_run_and_removes_the_tee():
    """The ball flies through the tee's position without a contact."""
    arm = SimulatedArm(ROBOT)
    tee = arm.scene.data.mocap_pos[arm.scene.tee]
    x, y, z = tee.tolist()
    fly(arm, 10)
    assert arm.throw(Throw(position=(x + 0.25, y, z), velocity=(-5.0, 0.0, 0.25))) == 0.01
    fly(arm, 80)
    ball = arm.ball() or pytest.fail("there is a ball")
    assert ball.velocity[0] < -4.8
    assert (tee.tolist(), arm.contacts(), arm.observe().tick) == (list(TEE_STORE), [], 90)


@pytest.mark.parametrize(
    ("throw", "field", "sentence"),
    [
        (Throw(position=(101.0, 0, 1), velocity=(0, 0, 0)), "position", "it must lie within 100 (m, m/s) of 0"),
        (Throw(position=(2.0, 0, 1), velocity=(np.nan, 0, 0)), "velocity", "velocity is [nan, 0, 0]"),
        (Throw(position=(2.0, 0, 1), velocity=(0, 0, 0), spin=(0, 2e3, 0)), "spin", "within 1000 rad/s"),
        (Throw(position=(2.0, 0, 0.02), velocity=(0, 0, 0)), "position", "inside 'floor'; choose a place beside it"),
        (Throw(position=(0.0, 0.0, 0.3), velocity=(0, 0, 0)), "position", "inside 'base'"),
    ],
)
def test_a_refused_throw_changes_nothing(throw: Throw, field: str, sentence: str):
    arm = SimulatedArm(ROBOT)
    before, tee = arm.ball(), arm.scene.data.mocap_pos.copy()
    with pytest.raises(Refusal) as raised:
        arm.throw(throw)
    assert (raised.value.code, raised.value.detail) == ("bad_message", {"field": field})
    assert sentence in raised.value.message
    assert arm.ball() == before
    np.testing.assert_array_equal(arm.scene.data.mocap_pos, tee)


def test_without_noise_sights_are_exact_and_without_latency():
    arm = SimulatedArm(ROBOT)
    arm.throw(THROW)
    seen = fly(arm, 50)
    assert [sight.time for sight in seen] == [0.0, 0.01, 0.02, 0.03, 0.04, 0.05]
    assert all(s.truth and (s.position, s.velocity) == (s.truth.position, s.truth.velocity) for s in seen)


def test_ball_noise_adds_latency_noise_and_losses_to_sights():
    def watch(seed: int) -> list[BallState]:
        arm = SimulatedArm(ROBOT, seed)
        arm.disturb(Disturb(kind="ball_noise", position_std=0.005, latency_s=0.0095, drop_rate=0.3))
        arm.throw(THROW)
        assert fly(arm, 9) == [], "the latency is not over yet"
        return fly(arm, 300)

    seen = watch(1)
    assert 10 < len(seen) < 29, "some are lost"
    assert all(sight.velocity is None for sight in seen)
    errors = np.array([np.subtract(sight.position, sight.truth.position) for sight in seen if sight.truth])
    assert 0.003 < errors.std() < 0.007
    assert seen == watch(1)
    assert [sight.position for sight in seen] != [sight.position for sight in watch(2)]


def test_a_new_run_ends_ball_noise():
    arm = SimulatedArm(ROBOT)
    arm.disturb(Disturb(kind="ball_noise", drop_rate=1.0))
    assert [active.kind for active in arm.disturbances()] == ["ball_noise"]
    assert fly(arm, 30) == []
    arm.begin_run()
    assert arm.disturbances() == []
    assert len(fly(arm, 10)) == 2


def test_ball_noise_and_throws_are_refused_without_a_ball():
    arm = SimulatedArm(replace(ROBOT, ball=None))
    with pytest.raises(Refusal, match="this robot's scene has no ball"):
        arm.disturb(Disturb(kind="ball_noise", position_std=0.01))
    with pytest.raises(Refusal, match="this robot's scene has no ball"):
        arm.throw(THROW)


def test_wind_accelerates_the_ball_until_the_next_run():
    arm = SimulatedArm(ROBOT)
    assert arm.config.ball is not None
    arm.disturb(Disturb(kind="wind", values=[0.0, 20.0, 0.0]))
    assert [active.values for active in arm.disturbances()] == [[0.0, 20.0, 0.0]]
    arm.throw(Throw(position=THROW.position, velocity=THROW.velocity))
    x, y, z = THROW.velocity
    fly(arm, 1)
    truth = arm.ball() or pytest.fail("there is a ball")
    air = np.array([x, y - 20.0, z])
    gained = -arm.config.ball.drag * np.linalg.norm(air) * air * 1e-3
    assert truth.velocity[1] - y == pytest.approx(gained[1], rel=1e-3)
    arm.begin_run()
    assert arm.disturbances() == []
    for wrong in ([1.0], [0.0, 0.0, 99.0], None):
        with pytest.raises(Refusal, match="three numbers within 50 m/s"):
            arm.disturb(Disturb(kind="wind", values=wrong))
    with pytest.raises(Refusal, match="duration belongs to another kind"):
        arm.disturb(Disturb(kind="wind", values=[0.0, 1.0, 0.0], duration=1.0))
