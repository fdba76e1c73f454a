"""The best of several ends, compared with a separate plan for each of them."""

from dataclasses import replace

import numpy as np
import pytest

from motion.alternatives import AllRefused, End, least_errors, plan_best
from motion.errors import LimitExceeded, MotionError
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest, Waypoint
from tests.splines_of import TIMES, figure_strike, fitted


@pytest.fixture(scope="module")
def two() -> Primitive:
    """A primitive of two joints: the strike of the paper's figures and a slower movement."""
    return fitted(TIMES, np.stack([figure_strike(TIMES), np.sin(2 * TIMES)], axis=1))


def ends_near(primitive: Primitive, seed: int, count: int = 12) -> list[End]:
    rng = np.random.default_rng(seed)
    goal, free = primitive.goal, np.full(2, np.nan)
    return [
        End(
            Boundary(goal.positions + rng.uniform(-0.3, 0.3, 2), goal.velocities * rng.uniform(0.7, 1.3, 2), free),
            rng.uniform(0.7, 1.4),
        )
        for _ in range(count)
    ]


def request_of(primitive: Primitive, limits: Limits, **more: object) -> MotionRequest:
    start = Boundary(primitive.start.positions + 0.05, np.zeros(2), np.zeros(2))
    return MotionRequest(start, primitive.goal, 1.0, limits, tail="coast", **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("more", [{}, {"phase": 0.4}, {"start_free": True}])
def test_least_errors_are_those_of_plans_without_limits(two: Primitive, more: dict[str, object]) -> None:
    free = more.pop("start_free", False)
    request = request_of(two, Limits.unlimited(2), **more)
    if free:
        request = replace(request, start=replace(request.start, accelerations=np.array([np.nan, 2.0])))
    ends = ends_near(two, 1)
    found = least_errors(two, request, ends)
    for end, error in zip(ends, found, strict=True):
        planned = plan(two, replace(request, goal=end.goal, duration=end.duration))
        assert error == pytest.approx((planned.report.imitation_rms**2).sum(), rel=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_the_feasible_end_with_the_least_error_is_planned(two: Primitive, seed: int) -> None:
    limits = Limits(
        np.array([[-1.5, 1.5]] * 2), np.array([7.0, 3.0]), np.array([75.0, 12.0]), np.array([2500.0, 500.0])
    )
    request, ends = request_of(two, limits), ends_near(two, seed)
    errors = []
    for end in ends:
        try:
            planned = plan(two, replace(request, goal=end.goal, duration=end.duration), remedy=False)
            errors.append(((planned.report.imitation_rms / limits.accelerations) ** 2).sum())
        except MotionError:
            errors.append(np.inf)
    assert np.isfinite(min(errors))
    index, best = plan_best(two, request, ends)
    assert index == int(np.argmin(errors))
    assert best.request.goal is ends[index].goal
    assert best.request.duration == ends[index].duration
    assert np.isfinite(errors[index])


def test_all_refused_has_the_error_of_each_end(two: Primitive) -> None:
    limits = Limits(np.array([[-1.5, 0.5]] * 2), np.full(2, 9.0), np.full(2, 100.0), np.full(2, 5000.0))
    request = request_of(two, limits)
    outside = [End(replace(two.goal, positions=np.array([0.1, 0.6 + k])), 1.0) for k in range(3)]
    with pytest.raises(AllRefused) as caught:
        plan_best(two, request, outside)
    found = [(error.joint, error.value) for error in caught.value.errors if isinstance(error, LimitExceeded)]
    assert found == [(1, 0.6), (1, 1.6), (1, 2.6)]


def test_an_end_before_a_waypoint_does_not_refuse_the_other_ends(two: Primitive) -> None:
    """The end before the waypoint has the least imitation error and is skipped all the same."""
    waypoint = Waypoint(0.95, np.array([0.3, np.nan]), np.full(2, np.nan))
    start = Boundary(two.start.positions, two.start.velocities, np.full(2, np.nan))
    request = MotionRequest(start, two.goal, 1.0, Limits.unlimited(2), waypoints=(waypoint,), tail="coast")
    far = replace(two.goal, positions=two.goal.positions + 1.0)
    ends = [End(far, 1.0), End(two.goal, 0.94)]
    assert np.argmin(least_errors(two, request, ends)) == 1
    assert plan_best(two, request, ends)[0] == 0
