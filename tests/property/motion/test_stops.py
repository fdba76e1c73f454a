"""The closed form of the stop against the stop that Ruckig plans, and the search built on it."""

import numpy as np
import pytest
import ruckig
from hypothesis import example, given, settings
from hypothesis import strategies as st

from motion.braking import fastest_stop, first_stop, stop
from motion.errors import CannotStop
from motion.limits import Limits
from motion.program.terminal_set import TRIED, final_accelerations
from motion.request import Boundary, MotionRequest
from motion.trajectory import ARRIVED, Samples

velocity = st.one_of(st.just(0.0), st.floats(-15, 15))
part = st.floats(-1, 1)
limit = st.floats(1, 500)
jerk = st.floats(50, 20000)


def stop_extremes(positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray, *bounds: np.ndarray):
    """Return the extremes of the stop from each state, with bounds of acceleration and jerk."""
    return fastest_stop(velocities, accelerations, *bounds).extremes(positions)


def one_joint(acceleration: float, jerk: float, room: float = np.inf, speed: float = np.inf) -> Limits:
    return Limits(np.array([[-room, room]]), np.array([speed]), np.array([acceleration]), np.array([jerk]))


@settings(max_examples=200, deadline=None)
@given(velocity, part, limit, jerk, st.floats(-2, 2))
def test_closed_form_agrees_with_the_sampled_stop(v: float, part: float, a: float, j: float, p: float) -> None:
    limits = one_joint(a, j)
    state = np.array([p]), np.array([v]), np.array([part * a])
    planned = stop(*state, limits)
    sampled = planned.sample(np.linspace(0, planned.duration, 4001))
    p_min, p_max, v_min, v_max = stop_extremes(*state, limits.accelerations, limits.jerks)
    # Between samples the curve bulges by no more than the eighth of curvature times step squared.
    step = planned.duration / 4000
    slack_p, slack_v = a * step**2 / 8 + 1e-9, j * step**2 / 8 + 1e-9
    assert abs(sampled.positions.min() - p_min[0]) < slack_p
    assert abs(sampled.positions.max() - p_max[0]) < slack_p
    assert abs(min(sampled.velocities.min(), 0) - min(v_min[0], 0)) < slack_v
    assert abs(max(sampled.velocities.max(), 0) - max(v_max[0], 0)) < slack_v


@settings(max_examples=200, deadline=None)
@given(velocity, part, limit, jerk)
def test_a_stop_is_the_one_that_ruckig_plans(v: float, part: float, a: float, j: float) -> None:
    """The stop is as short as Ruckig's and takes the same way."""
    planned = stop(np.array([0.3]), np.array([v]), np.array([part * a]), one_joint(a, j))
    wanted = ruckig.InputParameter(1)
    wanted.control_interface = ruckig.ControlInterface.Velocity
    wanted.current_position, wanted.current_velocity, wanted.current_acceleration = [0.3], [v], [part * a]
    wanted.target_velocity, wanted.target_acceleration = [0.0], [0.0]
    wanted.max_acceleration, wanted.max_jerk = [a], [j]
    theirs = ruckig.Trajectory(1)
    assert ruckig.Ruckig(1).calculate(wanted, theirs) in (ruckig.Result.Working, ruckig.Result.Finished)
    assert planned.duration == pytest.approx(theirs.duration, rel=1e-6, abs=1e-8)
    times = np.linspace(0, theirs.duration, 50)
    found = planned.sample(times)
    states = np.array([theirs.at_time(t) for t in times])[:, :, 0]
    assert found.positions[:, 0] == pytest.approx(states[:, 0], rel=1e-6, abs=1e-6)
    assert found.velocities[:, 0] == pytest.approx(states[:, 1], rel=1e-6, abs=1e-6 * (1 + abs(v)))
    assert found.accelerations[:, 0] == pytest.approx(states[:, 2], abs=1e-6 * j + 1e-6 * a)


@settings(max_examples=100, deadline=None)
@given(velocity, part, limit, jerk)
@example(0.001953125, 5.960464477539063e-08, 1.0, 299.0)  # a sample lies 1e-10 s before two pieces meet
def test_stop_keeps_acceleration_and_jerk_and_ends_at_rest(v: float, part: float, a: float, j: float) -> None:
    limits = one_joint(a, j)
    planned = stop(np.array([0.3]), np.array([v]), np.array([part * a]), limits)
    times = np.linspace(0, planned.duration, 2001)
    sampled = planned.sample(times)
    assert np.abs(sampled.accelerations).max() <= a * (1 + 1e-9)
    if planned.duration > 1e-6:
        # A sample up to `ARRIVED` before two pieces meet is taken from the second one, whose jerk is opposite.
        assert np.abs(np.diff(sampled.accelerations[:, 0])).max() <= j * (times[1] + 2 * ARRIVED) * (1 + 1e-6) + 1e-9
        slope = np.diff(sampled.positions[:, 0]) / times[1]
        middle = (sampled.velocities[1:, 0] + sampled.velocities[:-1, 0]) / 2
        assert np.abs(slope - middle).max() <= j * times[1] ** 2 / 6 + 1e-6
    rest = planned.sample(np.array([planned.duration, planned.duration + 1]))
    assert np.all(rest.velocities == 0)
    assert np.all(rest.accelerations == 0)
    assert np.ptp(rest.positions) == 0
    # The last piece leads to rest by itself; it is not switched off.
    before = planned.sample(np.array([planned.duration - 1e-7]))
    assert abs(before.velocities[0, 0]) < 1e-5
    assert abs(before.accelerations[0, 0]) < j * 1e-7 + 1e-5


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_first_stop_is_the_first_that_stays_inside(seed: int) -> None:
    rng = np.random.default_rng(seed)
    limits = Limits(np.array([[-1.0, 1.0]] * 2), np.full(2, 6.0), np.full(2, 80.0), np.full(2, 2000.0))
    t = np.arange(60) * 0.005
    w, phase = rng.uniform(3, 12, 2), rng.uniform(0, 6, 2)
    amplitude = rng.uniform(0.2, 0.95, 2)
    x = w * t[:, None] + phase
    samples = Samples(amplitude * np.sin(x), amplitude * w * np.cos(x), -amplitude * w**2 * np.sin(x))
    inside = []
    for p, v, a in zip(samples.positions, samples.velocities, samples.accelerations, strict=True):
        planned = stop(p, v, a, limits)
        sampled = planned.sample(np.linspace(0, planned.duration, 1000))
        inside.append(
            np.all(np.abs(sampled.positions) <= 1.0 + 1e-6) and np.all(np.abs(sampled.velocities) <= 6.0 + 1e-4)
        )
    found = first_stop(samples, limits)
    assert found == (inside.index(True) if True in inside else None)


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.5, 12),
    st.floats(-0.9, 0.9),
    st.floats(20, 300),
    st.floats(500, 15000),
    st.floats(1.001, 2),
    st.booleans(),
)
@example(v=8.0, p=0.75, a=126.0, j=500.0, headroom=2.0, backward=False)
def test_free_final_acceleration_is_confined_to_what_can_be_stopped(
    v: float, p: float, a: float, j: float, headroom: float, backward: bool
) -> None:
    sign = -1.0 if backward else 1.0
    top_speed = v * headroom
    limits = one_joint(a, j, room=1.0, speed=top_speed)
    request = _hit(sign * p, sign * v, limits)

    def stops(speed: float, acceleration: float) -> bool:
        state = np.array([sign * p]), np.array([sign * speed]), np.array([sign * acceleration])
        p_min, p_max, v_min, v_max = stop_extremes(*state, limits.accelerations, limits.jerks)
        return bool(p_min >= -1 - 2e-9 and p_max <= 1 + 2e-9 and max(-v_min, v_max) <= top_speed + 2e-9)

    trials = np.linspace(-a, a, 201)
    try:
        low, high = np.sort(sign * final_accelerations(request)[0])
    except CannotStop as refusal:
        assert not any(stops(v, trial) for trial in trials)
        assert refusal.max_velocity is not None
        top = sign * refusal.max_velocity
        assert 0 <= top <= v
        confined = final_accelerations(_hit(sign * p, sign * top, limits))[0]
        assert confined[0] <= confined[1]
        with pytest.raises(CannotStop):
            final_accelerations(_hit(sign * p, sign * min(v, top * 1.0001 + 1e-4), limits))
        return
    for trial in trials:
        if low + 1e-6 * a < trial < high - 1e-6 * a:
            assert stops(v, trial)
        if trial < low - 1e-6 * a or trial > high + 1e-6 * a:
            assert not stops(v, trial)


@settings(max_examples=200, deadline=None)
@given(st.floats(0.5, 11.9), st.floats(-0.99, 0.99), st.floats(-1, 1), st.floats(50, 500), st.floats(1000, 20000))
def test_the_velocity_named_can_be_stopped_with_the_final_acceleration_given(
    v: float, p: float, part: float, a: float, j: float
) -> None:
    limits = one_joint(a, j, room=1.0, speed=12.0)

    def stops(speed: float) -> bool:
        state = np.array([p]), np.array([speed]), np.array([part * a])
        p_min, p_max, v_min, v_max = stop_extremes(*state, limits.accelerations, limits.jerks)
        return bool(p_min >= -1 - 1e-9 and p_max <= 1 + 1e-9 and max(-v_min, v_max) <= 12 + 1e-9)

    try:
        final_accelerations(_hit(p, v, limits, part * a))
    except CannotStop as refusal:
        assert not stops(v)
        top = refusal.max_velocity
        if top is None:  # a window between two of the velocities that are tried is not found
            assert not any(stops(speed) for speed in np.linspace(0, v, TRIED))
            return
        assert stops(top)
        assert not any(stops(speed) for speed in np.linspace(top * (1 + 2e-6) + 1e-6, v, 301) if speed < v)
    else:
        assert stops(v)


def _hit(position: float, velocity: float, limits: Limits, acceleration: float = np.nan) -> MotionRequest:
    start = Boundary(np.zeros(1), np.zeros(1), np.zeros(1))
    goal = Boundary(*(np.array([value]) for value in (position, velocity, acceleration)))
    return MotionRequest(start, goal, 1.0, limits)
