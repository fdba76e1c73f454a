"""Plans of random goals: limits on curves sampled a hundred times finer, prescribed values, the report."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.interpolate import PPoly

from motion.errors import CannotStop, Infeasible, MotionError
from motion.limits import QUANTITIES
from motion.plan import SplinePlan, plan
from motion.primitive import Primitive
from motion.program.terminal_set import final_accelerations
from motion.request import MotionRequest
from motion.trajectory import Trajectory
from tests.property.motion.in_seconds import curve_of
from tests.property.motion.random_goals import any_manner, in_other_time, make_primitive, random_request, together

seeds = st.integers(0, 2**32 - 1)

FINE = 100_001
ROUNDING, TOUCH = 1e-10, 1e-6
"""Parts of a limit's range by which a curve may exceed it: anywhere, and where a prescribed value lies on it."""


def drawn(seed: int, tail: str, joints: int | None = None) -> tuple[Primitive, MotionRequest]:
    """Return a request of one to four joints, each with its own limits and waypoints."""
    rng = np.random.default_rng(seed)
    manner, requests = any_manner(rng), []
    if tail == "coast":
        manner = replace(manner, follow_through=0.0)
    joints = joints or int(rng.integers(1, 5))
    for joint in range(joints):
        own = np.random.default_rng((seed, joint))
        requests.append(random_request(own, make_primitive(own), tail, manner))
    times = [w.time_from_start for request in requests for w in request.waypoints]
    assume(all(abs(a - b) > 0.011 * requests[0].duration for k, a in enumerate(times) for b in times[:k]))
    primitive = make_primitive(*(np.random.default_rng((seed, joint)) for joint in range(joints)))
    return primitive, together(requests)


def planned_or_not(primitive: Primitive, request: MotionRequest) -> SplinePlan:
    """Return the plan; skip the case if the request is refused."""
    try:
        return plan(primitive, request)
    except MotionError:
        assume(False)
        raise


def moving(planned: SplinePlan) -> np.ndarray:
    """Return all four quantities (4, n, J) of the moving part, from its control points."""
    end = planned.request.moving_duration
    curve, t = curve_of(planned.control_points, end), np.linspace(0, end, FINE)
    return np.array([curve(t, order) for order in range(4)])


def behind(planned: SplinePlan) -> np.ndarray:
    """Return all four quantities (4, n, J) after the moving part, up to the last break."""
    start = planned.request.moving_duration
    motion, breaks = as_polynomials(planned.trajectory)
    later = np.concatenate([[start], breaks[breaks > start * (1 + 1e-12)]])
    # Without the ends of the pieces, at which jerk jumps.
    t = np.concatenate([[later[-1]], *(np.linspace(a, b, 2001)[1:-1] for a, b in pairwise(later))])
    return np.array([motion.derivative(order)(t) if order else motion(t) for order in range(4)])


def as_polynomials(trajectory: Trajectory) -> tuple[PPoly, np.ndarray]:
    """Return the trajectory as scipy's polynomials, and its breaks; pieces of no length are left out."""
    keep = np.diff(trajectory.breaks) > 0
    breaks = np.concatenate([trajectory.breaks[:-1][keep], trajectory.breaks[-1:]])
    return PPoly(trajectory.coefficients[keep].transpose(2, 0, 1)[::-1], breaks), breaks


def allowed(request: MotionRequest) -> np.ndarray:
    """Return the tolerance (J, 4) by which a quantity may exceed its limit."""
    ranges = request.limits.ranges
    width = np.ptp(ranges, axis=2)
    states = [(e.positions, e.velocities, e.accelerations) for e in (request.start, request.goal)]
    nothing = np.full(request.joint_count, np.nan)
    states += [(w.positions, w.velocities, nothing) for w in request.waypoints]
    straight = request.rest_fraction * request.duration * request.goal.velocities
    states += [(request.goal.positions - straight, nothing, request.final_accelerations)]
    fixed = np.array([[*state, nothing] for state in states]).transpose(2, 1, 0)  # (J, 4, F)
    apart = np.abs(fixed[..., None] - ranges[:, :, None]).min(axis=3)
    touching = (np.nan_to_num(apart, nan=np.inf) < 1e-6 * width[..., None]).any(axis=2)
    # On a limit a curve can only turn: its derivative is 0 there, and touches no limit of its own.
    return np.where(touching, TOUCH, ROUNDING) * width


def check_limits(planned: SplinePlan) -> None:
    """Check that no value exceeds its limit or the extremes in the report."""
    request, report = planned.request, planned.report
    slack = allowed(request)
    for values in (moving(planned), behind(planned)):
        for quantity, name in enumerate(QUANTITIES):
            low, high = request.limits.ranges[:, quantity].T
            curves, room = values[quantity], slack[:, quantity]
            assert np.all(curves <= high + room), (name, (curves - high).max(axis=0) / np.ptp([low, high], axis=0))
            assert np.all(curves >= low - room), (name, (low - curves).max(axis=0) / np.ptp([low, high], axis=0))
            lowest, highest = report.extremes[name].T
            hair = 2e-6 * np.ptp(curves, axis=0) + 1e-9 * (1 + np.abs(curves).max(axis=0))
            assert np.all(curves.max(axis=0) <= highest + hair), name
            assert np.all(curves.min(axis=0) >= lowest - hair), name


@settings(max_examples=40, deadline=None)
@given(seeds, st.sampled_from(["stop", "coast"]))
def test_no_limit_is_passed_at_any_time(seed: int, tail: str) -> None:
    planned = planned_or_not(*drawn(seed, tail))
    assert planned.report.certified
    check_limits(planned)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_extremes_are_those_of_the_curve(seed: int) -> None:
    """The curve reaches every reported extreme to 2e-6 of its spread, and exceeds none."""
    planned = planned_or_not(*drawn(seed, "coast"))
    values = moving(planned)
    for quantity, name in enumerate(QUANTITIES):
        curves = values[quantity]
        if planned.request.rest_fraction and quantity == 0:
            curves = np.concatenate([curves, planned.request.goal.positions[None]])
        lowest, highest = planned.report.extremes[name].T
        hair = 2e-6 * np.ptp(curves, axis=0) + 1e-12 * (1 + np.abs(curves).max(axis=0))
        assert np.all(np.abs(highest - curves.max(axis=0)) < hair), name
        assert np.all(np.abs(lowest - curves.min(axis=0)) < hair), name
        # Between two samples a cubic, or a smoother curve, rises by less than this.
        between = 1e-6 * np.ptp(curves, axis=0) + 1e-12 * (1 + np.abs(curves).max(axis=0))
        assert np.all(highest < curves.max(axis=0) + between), name
        assert np.all(lowest > curves.min(axis=0) - between), name
        low, high = planned.request.limits.ranges[:, quantity].T
        assert np.array_equal(planned.report.margin[name], np.minimum(lowest - low, high - highest))


@settings(max_examples=40, deadline=None)
@given(seeds, st.sampled_from(["stop", "coast"]))
def test_prescribed_values_are_met(seed: int, tail: str) -> None:
    primitive, request = drawn(seed, tail)
    planned = planned_or_not(primitive, request)
    times = [0.0, request.duration, request.moving_duration, *(w.time_from_start for w in request.waypoints)]
    got = planned.sample(np.array(times))

    def close(found: np.ndarray, wanted: np.ndarray, tolerance: float) -> None:
        assert np.all(np.isnan(wanted) | (np.abs(found - wanted) < tolerance))

    close(got.positions[0], request.start.positions, 1e-10)
    close(got.velocities[0], request.start.velocities, 1e-10)
    close(got.accelerations[0], request.start.accelerations, 1e-7)
    close(got.positions[1], request.goal.positions, 1e-9)
    close(got.velocities[1], request.goal.velocities, 1e-8)
    curve = curve_of(planned.control_points, request.moving_duration)
    close(curve(request.moving_duration, 2), request.final_accelerations, 1e-7)
    for k, waypoint in enumerate(request.waypoints, start=3):
        close(got.positions[k], waypoint.positions, 1e-9)
        close(got.velocities[k], waypoint.velocities, 1e-8)
    assert np.all(planned.report.final_error_positions < 1e-9)
    assert np.all(planned.report.final_error_velocities < 1e-8)


@settings(max_examples=40, deadline=None)
@given(seeds, st.sampled_from(["stop", "coast"]))
def test_pieces_join_twice_continuously(seed: int, tail: str) -> None:
    """Position, velocity and acceleration are equal on both sides of every break; the stop ends at rest by itself."""
    planned = planned_or_not(*drawn(seed, tail))
    motion, breaks = as_polynomials(planned.trajectory)
    coefficients = motion.c[::-1]
    for order in range(3):
        ends = np.diff(breaks)
        left = motion.derivative(order).c if order else motion.c
        reached = np.array([np.polyval(left[:, k], ends[k]) for k in range(len(ends))])
        factor = (1, 1, 2)[order]
        begun = factor * coefficients[order]
        scale = np.abs(begun).max(axis=0) + 1.0
        assert np.all(np.abs(reached[:-1] - begun[1:]) < 1e-9 * scale), order
        if tail == "stop" and order:
            assert np.all(np.abs(reached[-1]) < 1e-8 * scale)
    fine = np.arange(0, planned.total_duration, 1e-4)
    sampled = planned.sample(fine)
    expected = np.array([motion.derivative(k)(fine) if k else motion(fine) for k in range(3)])
    inside = fine < breaks[-1]
    for found, wanted in zip((sampled.positions, sampled.velocities, sampled.accelerations), expected, strict=True):
        assert np.abs(found[inside] - wanted[inside]).max() < 1e-9 * (1 + np.abs(wanted[inside]).max())


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_a_stop_ends_at_rest_on_a_tick(seed: int) -> None:
    primitive, request = drawn(seed, "stop")
    try:
        planned = plan(primitive, request)
    except CannotStop as refusal:
        if refusal.max_velocity is None:
            assert np.isfinite(request.final_accelerations[refusal.joint])
            return
        own = np.arange(request.joint_count) == refusal.joint
        slower = replace(request.goal, velocities=np.where(own, refusal.max_velocity, 0.0 * request.goal.velocities))
        others = replace(request.limits, positions=np.where(own[:, None], request.limits.positions, [[-1e9, 1e9]]))
        final_accelerations(replace(request, goal=slower, limits=others))
        return
    except MotionError:
        assume(False)
        raise
    samples = planned.samples()
    assert len(samples) == round(planned.total_duration / 0.001) + 1
    assert np.all(samples.velocities[-1] == 0)
    assert np.all(samples.accelerations[-1] == 0)
    assert planned.total_duration >= planned.trajectory.duration - 1e-9 * 0.001
    steps = np.abs(np.diff(planned.sample(np.arange(0, planned.total_duration, 1e-4)).accelerations, axis=0))
    assert np.all(steps.max(axis=0) <= request.limits.jerks * 1e-4 * (1 + 1e-5) + 1e-6)


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_warm_and_cold_give_the_same_verdict(seed: int) -> None:
    """A solver that remembers another motion's rows gives the same verdict and cost as a new one."""
    primitive, request = drawn(seed, "stop")
    other, before = drawn(seed + 1, "stop", request.joint_count)
    try:
        warm = plan(other, before).warm
    except MotionError:
        assume(False)
        raise
    verdicts = []
    for rows in (None, warm):
        try:
            verdicts.append(plan(primitive, request, warm=rows, remedy=False))
        except MotionError as refusal:
            verdicts.append(type(refusal))
    cold, found = verdicts
    if isinstance(cold, SplinePlan) and isinstance(found, SplinePlan):
        check_limits(found)
        width = np.ptp(moving(cold)[2], axis=0)
        assert np.all(np.abs(found.report.imitation_rms - cold.report.imitation_rms) < 2e-3 * width)
    else:
        assert cold == found


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_joints_planned_together_move_as_each_alone(seed: int) -> None:
    """Joints have their own start, goal, limits and waypoints; together and alone they differ by rounding only."""
    primitive, request = drawn(seed, "coast", 2)
    assume(not request.waypoints)  # the number of functions follows from all of them
    planned = planned_or_not(primitive, request)
    manner = replace(any_manner(np.random.default_rng(seed)), follow_through=0.0)
    for joint in range(2):
        own = np.random.default_rng((seed, joint))
        alone_primitive = make_primitive(own)
        alone = random_request(own, alone_primitive, "coast", manner)
        one = plan(alone_primitive, alone)
        if one.warm.points != planned.warm.points:
            continue  # one of them needed the finest hull, so all of them used it
        apart = np.abs(planned.control_points[joint] - one.control_points[0]).max()
        assert apart < 1e-5 * np.ptp(one.control_points), joint


@settings(max_examples=30, deadline=None)
@given(seeds, st.sampled_from([0.25, 0.5, 2.0, 4.0]))
def test_the_same_goal_in_other_time_is_the_same_motion(seed: int, factor: float) -> None:
    """Powers of two scale exactly: everything that depends on the duration is on the right-hand sides."""
    primitive, request = drawn(seed, "coast", 1)
    planned = planned_or_not(primitive, request)
    other = plan(primitive, in_other_time(request, factor))
    apart = np.abs(other.control_points - planned.control_points).max()
    assert apart <= 1e-6 * np.ptp(planned.control_points)


@pytest.mark.parametrize("seed", [0, 1, 6, 7, 8, 11, 12, 16, 17, 18, 21, 22])
def test_infeasible_requests_get_a_duration_that_works(seed: int) -> None:
    rng = np.random.default_rng(seed)
    primitive = make_primitive(rng)
    request = random_request(rng, primitive, "coast")
    wide = replace(request.limits, positions=request.limits.positions + np.array([[-1.0, 1.0]]))
    waypoints = tuple(replace(w, time_from_start=w.time_from_start / 4) for w in request.waypoints)
    hurried = replace(request, limits=wide, duration=request.duration / 4, waypoints=waypoints)
    with pytest.raises(Infeasible) as caught:
        plan(primitive, hurried)
    refusal = caught.value
    assert 0 <= refusal.time <= hurried.duration
    assert refusal.quantity in QUANTITIES
    assert refusal.min_duration is not None
    assert refusal.waypoint_times is not None
    assert refusal.min_duration > hurried.duration
    times = zip(hurried.waypoints, refusal.waypoint_times, strict=True)
    waypoints = tuple(replace(w, time_from_start=t) for w, t in times)
    check_limits(plan(primitive, replace(hurried, duration=refusal.min_duration, waypoints=waypoints)))


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_the_same_request_gives_the_same_bytes(seed: int) -> None:
    """Plans and refusals are repeated byte by byte."""
    answers = []
    for _ in range(2):
        try:
            planned = plan(*drawn(seed, "stop"))
            answers.append((planned.control_points.tobytes(), planned.trajectory.coefficients.tobytes()))
        except MotionError as refusal:
            answers.append(str(refusal))
    assert answers[0] == answers[1]
