"""Plans of single cases whose results are known independently."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BSpline

from motion.errors import InvalidMotion
from motion.limits import QUANTITIES, Limits
from motion.plan import WarmStart, plan
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest, Waypoint
from tests.splines_of import TIMES, figure_strike, fitted
from tests.unit.motion.asking import FREE, Ask

LIMITED = ("positions", "velocities", "accelerations", "jerks")


def test_without_limits_the_optimum_is_the_demonstration_plus_a_line(strike: Primitive, ask: Ask) -> None:
    """The optimum of eq. 10 is τ²d̈ plus a line in t, which the two final conditions determine."""
    request = ask(start=(0.2, -0.5), goal=(1.3, 6.0), duration=0.8, tail="coast")
    planned = plan(strike, request)
    t = np.linspace(0, 0.8, 1001)
    shown = strike.sample(t / 0.8)
    rate = 1 / 0.8
    # Changes of velocity and position at the end that the line a + bt must add.
    gained = 6.0 + 0.5 - rate * (shown.velocities[-1, 0] - shown.velocities[0, 0])
    travelled = 1.3 - 0.2 + 0.5 * 0.8 - (shown.positions[-1, 0] - shown.positions[0, 0] - shown.velocities[0, 0])
    line = np.linalg.solve([[0.8, 0.8**2 / 2], [0.8**2 / 2, 0.8**3 / 6]], [gained, travelled])
    optimum = rate**2 * shown.accelerations[:, 0] + line[0] + line[1] * t
    found = planned.sample(t).accelerations[:, 0]
    assert np.abs(found[:-1] - optimum[:-1]).max() < 1e-9 * np.abs(optimum).max()
    a, b = line
    error = math.sqrt(a * a + a * b * 0.8 + b * b * 0.8**2 / 3)
    assert planned.report.imitation_rms[0] == pytest.approx(error, rel=1e-9)


def test_the_demonstrations_own_conditions_reproduce_it(strike: Primitive, moves: Primitive) -> None:
    for primitive in (strike, moves):
        start, goal = primitive.start, primitive.goal
        request = MotionRequest(start, goal, primitive.duration, Limits.unlimited(1), tail="coast")
        planned = plan(primitive, request)
        width = np.ptp(primitive.control_points)
        assert planned.control_points == pytest.approx(primitive.control_points, abs=1e-9 * width)
        assert planned.report.from_demonstration.max[0] < 1e-9 * width
        assert planned.report.imitation_rms[0] < 1e-6


@pytest.mark.parametrize(
    "case",
    [
        {"duration": 0.8, "goal": (1.0, 6.0)},  # figure 2: other final velocity and duration
        {"goal": (-1.0, 10.0)},  # figure 3: the position limit shapes the motion
        {"goal": (-1.0, 10.0), "duration": 0.8, "start": (0.2, 0.0, 0.0)},
        {"waypoints": (Waypoint(0.5, np.array([1.0]), np.array([1.0])),)},  # figure 4
    ],
)
def test_the_papers_cases(strike: Primitive, ask: Ask, paper_limits: Limits, case: dict[str, object]) -> None:
    planned = plan(strike, ask(limits=paper_limits, **case))
    report, request = planned.report, planned.request
    assert report.certified
    assert report.final_error_positions[0] < 1e-10
    assert report.final_error_velocities[0] < 1e-9
    samples = planned.samples()
    for name, values, limit in (
        ("position", samples.positions, 2.0),
        ("velocity", samples.velocities, 15.0),
        ("acceleration", samples.accelerations, 300.0),
    ):
        assert np.abs(values).max() <= limit * (1 + 1e-12)
        assert report.margin[name][0] == pytest.approx(limit - np.abs(report.extremes[name]).max(), abs=1e-12)
    hit = planned.sample(np.array([request.duration]))
    assert hit.positions[0, 0] == pytest.approx(request.goal.positions[0], abs=1e-10)
    assert planned.hit_index == round(request.duration / 0.001)
    for waypoint in request.waypoints:
        there = planned.sample(np.array([waypoint.time_from_start]))
        assert there.positions[0] == pytest.approx(waypoint.positions, abs=1e-10)
        assert there.velocities[0] == pytest.approx(waypoint.velocities, abs=1e-9)


def test_the_report_has_quantity_and_time_of_an_active_limit(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    planned = plan(strike, ask(goal=(-1.0, 10.0), limits=paper_limits))
    times = np.linspace(0, 1, 1001)
    lowest = times[planned.sample(times).positions[:, 0].argmin()]
    positions = [a for a in planned.report.active if a.quantity == "position"]
    assert len(positions) == 1
    assert positions[0].time_from_start == pytest.approx(lowest, abs=0.01)
    assert planned.report.rounds >= 1
    assert planned.report.rows >= 1
    assert planned.report.basis_count == 50
    assert planned.report.phase == 0


def test_limits_that_are_not_active_change_nothing(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    free = plan(strike, ask(tail="coast"))
    wide = plan(strike, ask(limits=paper_limits, tail="coast"))
    assert wide.report.active == ()
    assert wide.control_points.tobytes() == free.control_points.tobytes()
    for report in (free.report, wide.report):
        assert report.by_limits.max[0] < 1e-14
        assert report.by_limits.rms[0] < 1e-14
        assert report.rounds == report.rows == 0
    assert all(np.isinf(free.report.margin[name]).all() for name in QUANTITIES)


@pytest.mark.parametrize("phase", [0.0, 0.37])
@pytest.mark.parametrize("rest_fraction", [0.0, 0.2])
def test_distances_in_the_report_agree_with_samples(
    strike: Primitive, ask: Ask, paper_limits: Limits, phase: float, rest_fraction: float
) -> None:
    """Distances from the demonstration at the same phase, and from the plan without limits."""
    narrow = replace(paper_limits, positions=np.array([[-1.15, 2.0]]))
    request = ask(goal=(-0.5, 3.0), limits=narrow, tail="coast", phase=phase, rest_fraction=rest_fraction, duration=0.9)
    planned = plan(strike, request)
    free = plan(strike, replace(request, limits=Limits.unlimited(1)))
    t = np.linspace(0, request.moving_duration, 20_001)
    begin, end = phase, phase + (1 - phase) * (1 - rest_fraction)
    shown = strike.positions(begin + (end - begin) * np.minimum(t / t[-1], 1))
    found, other = (BSpline(_knots(52, t[-1]), p.control_points[0], 5)(t) for p in (planned, free))
    for distance, apart in (
        (planned.report.from_demonstration, found - shown[:, 0]),
        (planned.report.by_limits, found - other),
        (free.report.from_demonstration, other - shown[:, 0]),
    ):
        assert distance.rms[0] == pytest.approx(np.sqrt(np.mean(apart**2)), rel=0.02)
        assert distance.max[0] == pytest.approx(np.abs(apart).max(), rel=0.02)
        assert distance.max[0] <= np.abs(apart).max() * (1 + 1e-6)
    assert planned.report.by_limits.max[0] > 0.01
    assert planned.report.phase == phase


def _knots(count: int, end: float) -> np.ndarray:
    return np.r_[np.zeros(5), np.linspace(0, end, count - 4), np.full(5, end)]


def test_joints_are_planned_independently(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    both = fitted(TIMES, np.stack([figure_strike(TIMES), np.sin(TIMES)], axis=1))
    two = Limits(*(np.repeat(getattr(paper_limits, f), 2, axis=0) for f in LIMITED))
    free = np.full(2, np.nan)
    request = MotionRequest(
        Boundary(np.zeros(2), np.zeros(2), free), Boundary(np.array([-1.0, 0.5]), np.array([10.0, 0.0]), free), 1.0, two
    )
    planned = plan(both, request)
    single = plan(strike, ask(start=(0.0, 0.0), goal=(-1.0, 10.0), limits=paper_limits))
    times = np.linspace(0, 1, 100)
    assert np.allclose(planned.sample(times).positions[:, 0], single.sample(times).positions[:, 0], atol=1e-6)
    assert {a.joint for a in planned.report.active} == {0}
    assert planned.report.imitation_rms.shape == (2,)
    assert planned.control_points.shape == (2, 52)
    assert [rows.size > 0 for rows in planned.warm.rows] == [True, False]


def test_basis_functions_are_added_for_close_waypoints(strike: Primitive, ask: Ask) -> None:
    """If waypoints are closer than two knot intervals of the demonstration, each interval is split."""

    def through(count: int) -> tuple[Waypoint, ...]:
        return tuple(Waypoint((k + 1) / (count + 1), np.zeros(1), FREE) for k in range(count))

    for count, functions in ((20, 50), (51, 3 + 47 * 3)):
        planned = plan(strike, ask(goal=(0.0, 1.0), waypoints=through(count)))
        assert planned.report.basis_count == functions
        assert np.abs(planned.sample(np.arange(1, count + 1) / (count + 1)).positions).max() < 1e-9


def test_a_mismatched_joint_count_is_refused(strike: Primitive, ask: Ask) -> None:
    free = np.full(2, np.nan)
    ends = Boundary(np.zeros(2), np.zeros(2), free)
    with pytest.raises(InvalidMotion, match="primitive"):
        plan(strike, MotionRequest(ends, ends, 1.0, Limits.unlimited(2)))
    with pytest.raises(InvalidMotion, match="warm"):
        plan(strike, ask(), warm=WarmStart(578, [np.zeros(0, dtype=int)] * 2))


def test_planning_is_deterministic_to_the_bit(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    request = ask(goal=(-1.0, 10.0), limits=paper_limits)
    one, two = (plan(strike, request).samples() for _ in range(2))
    assert one.positions.tobytes() == two.positions.tobytes()
    assert one.accelerations.tobytes() == two.accelerations.tobytes()
