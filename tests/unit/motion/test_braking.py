import numpy as np
import pytest

from motion.braking import fastest_stop, first_stop, stop
from motion.limits import Limits
from motion.trajectory import Samples


def stop_extremes(positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray, *bounds: np.ndarray):
    """Return lowest and highest position and velocity of the stop from each state; `bounds`: acceleration and jerk."""
    return fastest_stop(velocities, accelerations, *bounds).extremes(positions)


def test_a_stop_agrees_with_hand_calculation() -> None:
    """From 1 rad/s with A = 10 and J = 100: 0.1 s to −10 rad/s², no constant phase, 0.1 s back to 0; 0.1 rad in all."""
    limits = Limits(np.array([[-9.0, 9.0]]), np.array([9.0]), np.array([10.0]), np.array([100.0]))
    planned = stop(np.zeros(1), np.ones(1), np.zeros(1), limits)
    assert planned.duration == pytest.approx(0.2)
    assert planned.sample(planned.breaks[-1:]).positions[0] == pytest.approx([0.1])
    middle = planned.sample(np.array([0.1]))
    assert middle.accelerations[0, 0] == pytest.approx(-10)
    assert middle.velocities[0, 0] == pytest.approx(0.5)


def test_each_joint_stops_as_fast_as_its_own_limits_allow() -> None:
    limits = Limits(np.array([[-9.0, 9.0]] * 3), np.full(3, 9.0), np.array([5, 50, 50.0]), np.full(3, 1000.0))
    planned = stop(np.zeros(3), np.array([2.0, 2.0, 0.0]), np.zeros(3), limits)
    velocities = planned.sample(np.linspace(0, planned.duration, 1001)).velocities
    moving = (velocities > 1e-9).sum(axis=0)
    assert moving[0] >= 1000
    assert 4 * moving[1] < moving[0]
    assert moving[1] > 0
    assert not velocities[:, 2].any()


@pytest.mark.parametrize(("a", "j"), [(np.inf, 100.0), (10.0, np.inf), (np.inf, np.inf)])
def test_without_limits_a_stop_is_short(a: float, j: float) -> None:
    limits = Limits(np.array([[-9.0, 9.0]]), np.array([9.0]), np.array([a]), np.array([j]))
    planned = stop(np.zeros(1), np.ones(1), np.zeros(1), limits)
    p_min, p_max, _, _ = stop_extremes(np.zeros(1), np.ones(1), np.zeros(1), limits.accelerations, limits.jerks)
    assert planned.sample(planned.breaks[-1:]).positions[0] == pytest.approx(p_max, abs=1e-9)
    assert p_min == 0
    assert planned.duration <= 0.2 + 1e-6


def test_extremes_include_a_reversal_before_the_stop() -> None:
    """At −1 rad/s with +20 rad/s² the joint moves back by 0.027 rad before it reverses."""
    state = np.zeros(1), np.array([-1.0]), np.array([20.0])
    p_min, p_max, v_min, v_max = stop_extremes(*state, np.array([50.0]), np.array([100.0]))
    assert p_min[0] == pytest.approx(-0.0267, abs=2e-3)
    assert p_max[0] > 0
    assert v_min[0] == -1
    assert v_max[0] == pytest.approx(-1 + 400 / 200)


def test_fastest_stop_broadcasts_over_leading_dimensions() -> None:
    rng = np.random.default_rng(0)
    p, v, a = rng.normal(size=(3, 4, 5, 2))
    limits = np.array([3.0, 4.0]), np.array([50.0, 60.0])
    whole = stop_extremes(p, v, a, *limits)
    assert whole[0].shape == (4, 5, 2)
    for each, total in zip(stop_extremes(p[2, 3], v[2, 3], a[2, 3], *limits), whole, strict=True):
        assert np.array_equal(each, total[2, 3])


def test_first_stop_is_none_if_every_stop_leaves_the_limits() -> None:
    limits = Limits(np.array([[-0.1, 0.1]]), np.array([9.0]), np.array([10.0]), np.array([100.0]))
    fast = Samples(np.zeros((3, 1)), np.full((3, 1), 5.0), np.zeros((3, 1)))
    assert first_stop(fast, limits) is None
    slowing = Samples(np.zeros((3, 1)), np.array([[5.0], [0.5], [0.1]]), np.zeros((3, 1)))
    assert first_stop(slowing, limits) == 1


def test_joints_at_rest_reversing_and_moving_stop_together() -> None:
    """No division by zero in any of them: numpy's warnings are errors in tests."""
    limits = Limits(np.array([[-9.0, 9.0]] * 3), np.full(3, 9.0), np.full(3, 50.0), np.full(3, 100.0))
    state = np.zeros(3), np.array([0.0, -1.0, 2.0]), np.array([0.0, 20.0, 0.0])
    planned = stop(*state, limits)
    positions = planned.sample(np.linspace(0, planned.duration, 20_001)).positions
    low, high, _, _ = stop_extremes(*state, limits.accelerations, limits.jerks)
    assert low == pytest.approx(positions.min(axis=0), abs=1e-7)
    assert high == pytest.approx(positions.max(axis=0), abs=1e-7)
    assert low[1] < -0.02
    assert not positions[:, 0].any()


def test_a_stop_of_a_single_jerk_phase_does_not_overshoot() -> None:
    """On v = −a|a|/2J the stop is a single phase of constant jerk, for any rounding of v."""
    a = np.random.default_rng(0).uniform(-50, 50, 1000)
    low, high, _, _ = stop_extremes(np.zeros(1000), -a * np.abs(a) / 200, a, np.array(60.0), np.array(100.0))
    assert np.where(a < 0, high, low) == pytest.approx(-(a**3) / (6 * 100.0**2), abs=1e-9)
    assert np.where(a < 0, low, high) == pytest.approx(0.0, abs=1e-9)


def test_a_stop_of_whole_ticks_ends_at_rest() -> None:
    """Velocity and acceleration are exactly 0 in the last sample, even if rounding places it before the stop's end."""
    limits = Limits(np.array([[-9.0, 9.0]]), np.array([9.0]), np.array([1e3]), np.array([100.0]))
    for half in range(1, 300):
        halt = stop(np.zeros(1), np.array([100.0 * (half * 0.001) ** 2]), np.zeros(1), limits)
        last = halt.sample(np.arange(2 * half + 1) * 0.001)
        assert halt.duration == pytest.approx(2 * half * 0.001, abs=1e-12)
        assert not last.velocities[-1].any()
        assert not last.accelerations[-1].any()
        assert last.positions[-1] == halt.sample(halt.breaks[-1:]).positions[0]


def test_a_stop_that_takes_hours_is_planned() -> None:
    limits = Limits(np.array([[-9.0, 9.0]]), np.array([9.0]), np.array([1e3]), np.array([1e-8]))
    planned = stop(np.zeros(1), np.ones(1), np.zeros(1), limits)
    assert planned.duration == pytest.approx(2e4)
    assert planned.sample(planned.breaks[-1:]).positions[0] == pytest.approx([1e4])


def test_a_stop_at_rest_takes_no_time() -> None:
    limits = Limits(np.array([[-9.0, 9.0]] * 2), np.full(2, 9.0), np.full(2, 50.0), np.full(2, 100.0))
    planned = stop(np.array([1.0, -2.0]), np.zeros(2), np.zeros(2), limits)
    assert planned.duration == 0
    assert planned.sample(np.array([0.0, 3.0])).positions.tolist() == [[1.0, -2.0]] * 2


def test_an_acceleration_above_its_limit_is_only_reduced() -> None:
    """A disturbance can leave such an acceleration."""
    limits = Limits(np.array([[-9.0, 9.0]]), np.array([9.0]), np.array([10.0]), np.array([100.0]))
    for velocity in (-3.0, 0.0, 3.0):
        for acceleration in (-14.0, 14.0):
            planned = stop(np.zeros(1), np.array([velocity]), np.array([acceleration]), limits)
            found = planned.sample(np.linspace(0, planned.duration, 2001)).accelerations
            assert np.abs(found).max() <= 14 + 1e-9
            assert planned.sample(np.array([planned.duration])).velocities[0, 0] == 0


def test_a_stop_is_twice_continuously_differentiable_and_ends_in_a_piece_at_rest() -> None:
    rng = np.random.default_rng(1)
    limits = Limits(np.array([[-9.0, 9.0]] * 4), np.full(4, 9.0), np.full(4, 50.0), np.full(4, 1000.0))
    for _ in range(200):
        state = rng.normal(size=4), rng.normal(size=4) * 5, rng.uniform(-50, 50, 4)
        planned = stop(*state, limits)
        breaks, c = planned.breaks, planned.coefficients
        assert (np.diff(breaks) >= 0).all()
        assert breaks[-1] == breaks[-2]
        assert not c[-1, :, 1:].any()
        assert np.stack([c[0, :, 0], c[0, :, 1], 2 * c[0, :, 2]]) == pytest.approx(np.array(state), abs=1e-12)
        t = np.diff(breaks)[:-1, None, None] ** np.arange(4)
        p = (c[:-1, :, :4] * t).sum(axis=2)
        v = (c[:-1, :, 1:4] * [1, 2, 3] * t[..., :3]).sum(axis=2)
        a = (c[:-1, :, 2:4] * [2, 6] * t[..., :2]).sum(axis=2)
        for reached, begun in ((p, c[1:, :, 0]), (v, c[1:, :, 1]), (a, 2 * c[1:, :, 2])):
            assert np.abs(reached - begun).max() < 1e-9


def test_first_stop_checks_position_and_velocity() -> None:
    """1e-8 inside and outside of each bound."""
    limits = Limits(np.array([[-1.0, 1.0]]), np.array([2.0]), np.array([10.0]), np.array([100.0]))
    # From 1 rad/s with A = 10 and J = 100 the stop takes 0.1 rad; from 2 rad/s² the velocity rises by 2²/2J.
    for p, v, a, inside in (
        (0.9 - 1e-8, 1.0, 0.0, True),
        (0.9 + 1e-8, 1.0, 0.0, False),
        (-0.9 + 1e-8, -1.0, 0.0, True),
        (-0.9 - 1e-8, -1.0, 0.0, False),
        (0.0, 1.98 - 1e-8, 2.0, True),
        (0.0, 1.98 + 1e-8, 2.0, False),
        (0.0, -1.98 - 1e-8, -2.0, False),
        (1.0, 0.0, 0.0, True),
    ):
        state = Samples(np.array([[p]]), np.array([[v]]), np.array([[a]]))
        assert first_stop(state, limits) == (0 if inside else None), (p, v, a)
