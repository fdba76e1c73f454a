"""Durations that are too short: refusals name one that works, and `plan_fastest` finds it."""

from dataclasses import replace

import numpy as np
import pytest

from motion.errors import CannotStop, Infeasible, SolverFailed
from motion.limits import QUANTITIES, Limits
from motion.plan import plan, plan_fastest
from motion.primitive import Primitive
from motion.request import MotionRequest, Waypoint
from tests.unit.motion.asking import Ask


def test_a_motion_of_1_ms_is_planned_without_limits_and_infeasible_with_them(
    strike: Primitive, ask: Ask, paper_limits: Limits
) -> None:
    """The refusal names a duration that works."""
    hasty = ask(duration=0.001, goal=(1.0, 3.0))
    assert plan(strike, replace(hasty, tail="coast")).report.final_error_positions[0] < 1e-9
    with pytest.raises(Infeasible) as caught:
        plan(strike, replace(hasty, limits=paper_limits))
    assert caught.value.min_duration is not None
    assert plan(strike, replace(hasty, limits=paper_limits, duration=caught.value.min_duration)).report.certified


def test_infeasible_names_the_shortest_duration_found(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    waypoint = Waypoint(0.05, np.array([0.3]), np.array([np.nan]))
    hurried = ask(start=(0.0, 0.0, 0.0), duration=0.1, limits=paper_limits, waypoints=(waypoint,))
    with pytest.raises(Infeasible) as refusal:
        plan(strike, hurried)
    error = refusal.value
    assert error.min_duration is not None
    assert error.waypoint_times == pytest.approx([error.min_duration / 2])
    assert error.min_duration / 0.001 == pytest.approx(round(error.min_duration / 0.001), abs=1e-9)

    def at(duration: float) -> MotionRequest:
        return replace(hurried, duration=duration, waypoints=(replace(waypoint, time_from_start=duration / 2),))

    assert plan(strike, at(error.min_duration)).report.certified
    # It is the shortest duration found with bounded effort, so only a much shorter one is surely infeasible.
    with pytest.raises((Infeasible, SolverFailed)):
        plan(strike, at(error.min_duration / 3))
    with pytest.raises(Infeasible) as refusal:
        plan(strike, hurried, remedy=False)
    assert refusal.value.min_duration is None
    assert "allow more time" in str(refusal.value)


def test_the_fastest_duration_is_within_a_tenth_of_the_minimum(
    strike: Primitive, ask: Ask, paper_limits: Limits
) -> None:
    """The request's own duration has no influence."""
    request = ask(start=(0.0, 0.0, 0.0), limits=paper_limits)
    fastest = plan_fastest(strike, request)
    assert fastest.report.certified
    assert all(fastest.report.margin[name][0] >= 0 for name in QUANTITIES)
    assert fastest.duration / 0.001 == pytest.approx(round(fastest.duration / 0.001), abs=1e-9)
    assert plan_fastest(strike, replace(request, duration=7.0)).duration == fastest.duration
    with pytest.raises((Infeasible, SolverFailed)):
        plan(strike, replace(request, duration=0.9 * fastest.duration))


def test_plan_fastest_refuses_what_no_duration_makes_feasible(
    strike: Primitive, ask: Ask, paper_limits: Limits
) -> None:
    with pytest.raises(CannotStop):
        plan_fastest(strike, ask(goal=(1.9, 10.0), limits=paper_limits))
    outward = Waypoint(0.5, np.array([2.0]), np.array([1.0]))
    with pytest.raises(Infeasible) as refusal:
        plan_fastest(strike, ask(limits=paper_limits, waypoints=(outward,)))
    assert refusal.value.min_duration is None


def test_infeasible_names_durations_far_beyond_the_demonstrated_one(strike: Primitive, ask: Ask) -> None:
    """The search extends to the longest plan, 60 s."""
    slow = Limits(np.array([[-2.0, 2.0]]), np.array([0.07]), np.array([300.0]), np.array([15000.0]))
    request = ask(start=(0.0, 0.0), goal=(1.0, 0.0), limits=slow)
    with pytest.raises(Infeasible) as refusal:
        plan(strike, request)
    assert refusal.value.min_duration is not None
    assert 14 < refusal.value.min_duration < 60
    assert plan(strike, replace(request, duration=refusal.value.min_duration)).report.certified


def test_infeasible_names_no_duration_if_none_works(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    outward = Waypoint(0.5, np.array([2.0]), np.array([1.0]))
    with pytest.raises(Infeasible) as refusal:
        plan(strike, ask(limits=paper_limits, waypoints=(outward,)))
    assert refusal.value.min_duration is None
    assert refusal.value.time == pytest.approx(0.5, abs=0.02)


def test_infeasible_lists_five_waypoint_times_and_counts_the_others() -> None:
    error = Infeasible(0, "jerk", 0.25, (-9.0, 9.0), 2.0, [0.02 * k for k in range(1, 99)])
    assert str(error).endswith("works with waypoints at 0.02 s, 0.04 s, 0.06 s, 0.08 s, 0.1 s and 93 more")
    assert len(error.waypoint_times or []) == 98
