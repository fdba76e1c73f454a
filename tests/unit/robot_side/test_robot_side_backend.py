"""The contract of every backend with the loop of the robot side."""

from collections.abc import Iterator

import numpy as np
import pytest
from backends import BACKENDS
from setpoints import accelerating

from robot.description import load_robot
from services.common.robot_side.backend import Backend

ROBOT = load_robot()
PUSH = np.array([2.0, -1.0, 1.0, 0.5, 0.0, -0.5])


@pytest.fixture(params=BACKENDS)
def backend(request: pytest.FixtureRequest) -> Iterator[Backend]:
    """Each backend at the start of its first run."""
    backend = BACKENDS[request.param](ROBOT)
    yield backend
    backend.close()


def test_the_first_run_begins_ready_and_at_rest_at_home(backend: Backend):
    now = backend.observe()
    assert (now.tick, now.time, now.condition, now.reason) == (0, 0.0, "ready", "")
    assert now.positions == pytest.approx(ROBOT.home)
    assert now.velocities == pytest.approx(np.zeros(6))


def test_vectors_have_one_entry_for_each_joint(backend: Backend):
    backend.step(accelerating(PUSH))
    now = backend.observe()
    for vector in (now.positions, now.velocities, now.torques):
        assert (vector.shape, vector.dtype) == ((6,), np.float64)
    assert (now.saturated.shape, now.saturated.dtype) == ((6,), np.bool_)


def test_ticks_are_counted_and_time_is_tick_over_rate(backend: Backend):
    for tick in range(1, 31):
        backend.step(accelerating(np.zeros(6)))
        assert (backend.observe().tick, backend.observe().time) == (tick, tick / ROBOT.rate_hz)


def test_an_observation_is_not_changed_by_the_next_tick(backend: Backend):
    before = backend.observe()
    assert backend.observe() is before
    positions = before.positions.copy()
    backend.step(accelerating(PUSH))
    assert backend.observe() is not before
    np.testing.assert_array_equal(before.positions, positions)


def test_an_acceleration_is_constant_during_the_tick(backend: Backend):
    """After n ticks with a: v = a·n·dt and x = x₀ + a·(n·dt)²/2 in every joint."""
    for _ in range(100):
        backend.step(accelerating(PUSH))
    now, passed = backend.observe(), 100 * ROBOT.tick
    assert now.velocities == pytest.approx(PUSH * passed, abs=2e-3)
    assert now.positions == pytest.approx(ROBOT.home + PUSH * passed**2 / 2, abs=1e-4)


def test_a_new_run_begins_at_the_arms_present_position(backend: Backend):
    for sign in (1.0, -1.0):
        for _ in range(50):
            backend.step(accelerating(sign * PUSH))
    stands = backend.observe().positions
    backend.begin_run()
    now = backend.observe()
    assert (now.tick, now.time) == (0, 0.0)
    assert now.positions == pytest.approx(stands)
    assert not np.array_equal(now.positions, ROBOT.home)


def test_an_arm_that_is_ready_recovers_at_once(backend: Backend):
    backend.recover()
    assert backend.observe().condition == "ready"


def test_abilities_are_those_of_the_contract(backend: Backend):
    abilities = backend.abilities
    assert abilities.delay_ticks >= 0
    assert set(abilities.modes) <= {"torque", "position", "teach"}
    assert abilities.modes
    assert abilities.torques_are in ("commanded", "measured")
