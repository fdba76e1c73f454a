"""Plans of random goals: what holds for each, and for two plans of the same motion."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from motion.errors import CannotStop, Infeasible, MotionError
from motion.limits import QUANTITIES
from motion.plan import SplinePlan, plan
from motion.primitive import Primitive
from motion.program.terminal_set import final_accelerations
from motion.request import MotionRequest
from tests.property.motion.checks_of_plans import (
    check_extremes,
    check_joins,
    check_limits,
    check_prescribed_values,
    check_rest,
    moving,
)
from tests.property.motion.random_goals import any_manner, in_other_time, make_primitive, random_request, together

seeds = st.integers(0, 2**32 - 1)


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


@settings(max_examples=60, deadline=None)
@given(seeds, st.sampled_from(["stop", "coast"]))
def test_a_plan_keeps_its_limits_meets_its_values_and_joins_smoothly(seed: int, tail: str) -> None:
    """One plan serves all checks, because drawing and planning take longer than they."""
    primitive, request = drawn(seed, tail)
    try:
        planned = plan(primitive, request)
    except CannotStop as refusal:
        check_velocity_named(request, refusal)
        return
    except MotionError:
        assume(False)
        raise
    assert planned.report.certified
    check_limits(planned)
    check_prescribed_values(planned)
    check_joins(planned)
    if tail == "stop":
        check_rest(planned)
    else:
        check_extremes(planned)


def check_velocity_named(request: MotionRequest, refusal: CannotStop) -> None:
    """Check that the joint could stop from the velocity that the refusal names."""
    if refusal.max_velocity is None:
        assert np.isfinite(request.final_accelerations[refusal.joint])
        return
    own = np.arange(request.joint_count) == refusal.joint
    slower = replace(request.goal, velocities=np.where(own, refusal.max_velocity, 0.0 * request.goal.velocities))
    others = replace(request.limits, positions=np.where(own[:, None], request.limits.positions, [[-1e9, 1e9]]))
    final_accelerations(replace(request, goal=slower, limits=others))


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
