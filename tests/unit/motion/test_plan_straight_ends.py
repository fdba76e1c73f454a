"""Straight parts at the final velocity: `rest_fraction` before the goal, `follow_through` after it."""

from dataclasses import replace

import numpy as np
import pytest

from motion.errors import CannotStop, Infeasible, LimitExceeded
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive
from tests.unit.motion.asking import Ask


def test_a_large_rest_fraction_meets_its_goal(strike: Primitive, ask: Ask) -> None:
    """Large weights cancel each other, so only rounding errors may remain in the equalities."""
    for goal in np.linspace(-1.0, 1.0, 21):
        hasty = ask(start=(0.5, 0.0), goal=(float(goal), 0.0), duration=10.0, rest_fraction=0.99)
        assert plan(strike, hasty).report.final_error_positions[0] < 1e-7


def test_a_rest_fraction_ends_in_a_line_at_the_final_velocity(
    strike: Primitive, ask: Ask, paper_limits: Limits
) -> None:
    planned = plan(strike, ask(limits=paper_limits, rest_fraction=0.2))
    last = planned.sample(np.linspace(0.8, 1.0, 50)[1:-1])
    assert np.all(last.accelerations == 0)
    assert np.all(last.velocities == 3.0)
    hit = planned.sample(np.array([1.0]))
    assert hit.positions[0, 0] == pytest.approx(1.0, abs=1e-12)
    join = planned.sample(np.array([0.8 - 1e-9, 0.8, 0.8 + 1e-9]))
    for values in (join.positions, join.velocities, join.accelerations):
        assert np.ptp(values) < 1e-4


def test_a_follow_through_keeps_the_final_velocity(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    plain = plan(strike, ask(limits=paper_limits, goal=(0.5, 3.0, 0.0)))
    planned = plan(strike, ask(limits=paper_limits, goal=(0.5, 3.0), follow_through=0.1))
    assert planned.control_points == pytest.approx(plain.control_points, abs=1e-12)
    line = planned.sample(np.linspace(1.0, 1.1, 50)[:-1])
    assert line.accelerations[1:] == pytest.approx(0, abs=1e-9)
    assert line.velocities == pytest.approx(3.0, abs=1e-9)
    assert planned.sample(np.array([1.1])).positions[0, 0] == pytest.approx(0.8, abs=1e-9)
    assert planned.duration == 1.0
    assert planned.total_duration == pytest.approx(plain.total_duration + 0.1, abs=1.1e-3)
    assert planned.report.extremes["position"][0, 1] == pytest.approx(
        plain.trajectory.sample(plain.trajectory.breaks[-1:]).positions[0][0] + 0.3, abs=1e-6
    )


def test_a_follow_through_without_room_to_stop_is_refused(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    """The stop begins after the follow-through; the velocity named by the refusal allows both."""
    request = ask(limits=paper_limits, goal=(1.5, 5.0), follow_through=0.2)
    plan(strike, replace(request, follow_through=0.0))
    with pytest.raises(CannotStop) as caught:
        plan(strike, request)
    top = caught.value.max_velocity
    assert top is not None
    assert 0 < 0.2 * top < 0.5
    named = replace(request, goal=replace(request.goal, velocities=np.array([top])))
    assert plan(strike, named).report.extremes["position"][0, 1] <= 2.0 + 1e-9


def test_a_rest_fraction_that_leaves_no_time_is_refused_with_one_that_works(
    strike: Primitive, ask: Ask, paper_limits: Limits
) -> None:
    """If its line would begin outside the limits, the refusal names the largest one that begins inside."""
    hasty = ask(start=(0.0, 0.0), goal=(1.0, 0.5), limits=paper_limits, rest_fraction=0.99)
    with pytest.raises(Infeasible, match=r"a rest_fraction of 0\.\d+ works$") as caught:
        plan(strike, hasty)
    works = float(str(caught.value).split()[-2])
    assert plan(strike, replace(hasty, rest_fraction=works)).report.certified
    outside = ask(goal=(1.0, 10.0), limits=paper_limits, rest_fraction=0.99)
    with pytest.raises(LimitExceeded, match=r"where the rest_fraction, here at most 0\.\d+, begins lies") as refused:
        plan(strike, outside)
    most = float(str(refused.value).split("at most ")[1].split(",")[0])
    low = paper_limits.positions[0, 0]
    assert low <= 1.0 - most * 10.0 < low + 0.01 + 1e-9
