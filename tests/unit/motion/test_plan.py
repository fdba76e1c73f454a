"""Plans of single cases whose results are known independently."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BSpline

from motion import plan as plan_module
from motion.errors import CannotStop, Infeasible, InvalidMotion, LimitExceeded, MotionError, OutOfTime, SolverFailed
from motion.limits import QUANTITIES, Limits
from motion.plan import Warm, plan, plan_fastest
from motion.primitive import Primitive
from motion.program import constraint_generation, optimum
from motion.program.constraint_generation import Solution
from motion.program.contradiction import InfeasibleRows
from motion.program.terminal_set import final_accelerations
from motion.request import Boundary, MotionRequest, Waypoint
from tests.splines_of import TIMES, figure_strike, fitted, joint_of

Ask = Callable[..., MotionRequest]

LIMITED = ("positions", "velocities", "accelerations", "jerks")
FREE = np.full(1, np.nan)


@pytest.fixture(scope="module")
def strike() -> Primitive:
    """The demonstration of the paper's figures, with 50 basis functions."""
    return fitted(TIMES, figure_strike(TIMES)[:, None])


@pytest.fixture(scope="module")
def moves() -> Primitive:
    """Six moves of 1.5 s and 0.8 rad, there and back, with pauses; 20 s."""
    t = np.linspace(0, 20, 4001)
    positions = np.zeros_like(t)
    for k in range(6):
        s = np.clip((t - 1 - 3.1 * k) / 1.5, 0, 1)
        positions += (-1) ** k * 0.8 * (10 * s**3 - 15 * s**4 + 6 * s**5)
    return fitted(t, positions[:, None], 200)


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


def test_limits_do_not_make_positions_drift(moves: Primitive) -> None:
    """At 0.9 of the demonstrated peak velocity; without a place term the plan drifts 0.4 rad from the demonstration."""
    peak = np.abs(moves.sample(np.linspace(0, 1, 5001)).velocities).max()
    limits = replace(Limits.unlimited(1), velocities=np.array([0.9 * peak]))
    planned = plan(moves, MotionRequest(moves.start, moves.goal, 20.0, limits, tail="coast"))
    assert planned.report.active
    assert planned.report.extremes["velocity"].max() <= 0.9 * peak
    assert planned.report.from_demonstration.max[0] < 0.03


@pytest.mark.parametrize("place_time", [0.5, 1.0])
def test_a_place_time_confines_differences_to_the_ends(moves: Primitive, place_time: float) -> None:
    """Without it, differences of start and goal are spread over the whole motion."""
    start = replace(moves.start, positions=moves.start.positions + 0.3)
    request = MotionRequest(start, moves.goal, 20.0, Limits.unlimited(1), tail="coast")
    t = np.linspace(0, 19.9, 2000)
    apart = np.abs(plan(moves, request).sample(t).positions - moves.positions(t / 20))[:, 0]
    assert apart[t > 5].max() > 0.1
    local = plan(moves, replace(request, place_time=place_time))
    apart = np.abs(local.sample(t).positions - moves.positions(t / 20))[:, 0]
    assert apart[t > 8 * place_time].max() < 0.003
    goal = replace(moves.goal, positions=moves.goal.positions + 0.3)
    local = plan(moves, replace(request, start=moves.start, goal=goal, place_time=place_time))
    apart = np.abs(local.sample(t).positions - moves.positions(t / 20))[:, 0]
    assert apart[t < 20 - 8 * place_time].max() < 0.003


def cut(primitive: Primitive, phase: float) -> Primitive:
    """Return the rest of a demonstration from a phase on as a primitive, with accelerations fitted again."""
    s, count = np.linspace(0, 1, 20_001), primitive.basis_count
    left = (1 - phase) * primitive.duration
    accelerations = primitive.sample(phase + (1 - phase) * s).accelerations * left**2
    t = np.r_[np.zeros(3), np.linspace(0, 1, count - 2), np.ones(3)]
    rows = BSpline.design_matrix(s, t, 3).toarray()
    weights = np.ones(len(s))
    weights[[0, -1]] = math.sqrt(0.5)
    fit = np.linalg.lstsq(rows * weights[:, None], accelerations * weights[:, None], rcond=None)[0]
    state = primitive.sample(np.array([phase]))
    velocity = BSpline(t, fit, 3).antiderivative()
    velocity.c = velocity.c + left * state.velocities
    position = velocity.antiderivative()
    points = (position.c + state.positions)[: count + 2]
    return replace(primitive, duration=left, control_points=np.ascontiguousarray(points.T))


@pytest.mark.parametrize("place_time", [None, 0.2])
@pytest.mark.parametrize("halvings", [0.5, 1, 2, 3.5])
def test_planning_from_a_phase_imitates_the_rest_as_its_own_demonstration(
    strike: Primitive, ask: Ask, paper_limits: Limits, halvings: float, place_time: float | None
) -> None:
    """At phases for which a metric is prepared, with and without limits."""
    phase = 1 - 2.0**-halvings
    left = 1 - phase
    state = strike.sample(np.array([phase]))
    start = (state.positions[0, 0] + 0.02 * left, state.velocities[0, 0] + 0.1, state.accelerations[0, 0] + 3)
    request = ask(start=start, goal=(1.0 + 0.05 * left, 3.2), duration=0.95 * left, phase=phase, place_time=place_time)
    free = plan(strike, replace(request, tail="coast")).report
    limited = replace(
        paper_limits,
        accelerations=np.array([max(0.93 * np.abs(free.extremes["acceleration"]).max(), 1.01 * abs(start[2]))]),
    )
    for limits in (Limits.unlimited(1), limited):
        rest = plan(strike, replace(request, limits=limits, tail="coast"))
        own = plan(cut(strike, phase), replace(request, limits=limits, tail="coast", phase=0.0))
        width = np.ptp(own.control_points)
        assert rest.control_points == pytest.approx(own.control_points, abs=1e-5 * width)
        assert rest.report.imitation_rms == pytest.approx(own.report.imitation_rms, rel=2e-3)
        assert rest.report.phase == phase


@pytest.mark.parametrize("phase", [0.1, 0.5, 0.83, 0.97])
def test_the_rest_from_the_demonstrated_state_reproduces_the_demonstration(strike: Primitive, phase: float) -> None:
    state = strike.sample(np.array([phase]))
    start = Boundary(state.positions[0], state.velocities[0], state.accelerations[0])
    request = MotionRequest(start, strike.goal, 1 - phase, Limits.unlimited(1), tail="coast", phase=phase)
    for place_time in (None, 0.1):
        planned = plan(strike, replace(request, place_time=place_time))
        t = np.linspace(0, 1 - phase, 300)[:-1]
        assert planned.sample(t).positions == pytest.approx(strike.positions(phase + t), abs=1e-5)
        assert planned.report.from_demonstration.max[0] < 1e-5


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


@pytest.mark.parametrize("stuck", [0, 1, 2])
def test_only_a_joint_that_could_not_stop_is_planned_again(
    strike: Primitive, stuck: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its second plan is the one that it has without the other joints."""
    free, sizes = np.full(3, np.nan), np.array([1.0, 0.7, 0.5])
    together = fitted(TIMES, figure_strike(TIMES)[:, None] * sizes)
    # One joint has 0.035 rad behind its goal, the others 1 rad.
    highest = np.where(np.arange(3) == stuck, 0.535, 1.5)
    limits = Limits(
        np.stack([np.full(3, -3.0), highest], axis=1), np.full(3, 20.0), np.full(3, 200.0), np.full(3, 5000.0)
    )
    still, goal = Boundary(np.zeros(3), np.zeros(3), np.zeros(3)), Boundary(np.full(3, 0.5), np.full(3, 2.0), free)
    request = MotionRequest(still, goal, 1.0, limits)
    planned_joints = []
    solve = optimum.solve

    def noted(*args: object) -> Solution:
        planned_joints.append(args[-1])
        return solve(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(optimum, "solve", noted)
    planned = plan(together, request)
    assert [None if joints is None else joints.tolist() for joints in planned_joints] == [None, [stuck]]
    one = slice(stuck, stuck + 1)
    own = Limits(limits.positions[one], limits.velocities[one], limits.accelerations[one], limits.jerks[one])
    single = plan(joint_of(together, stuck), MotionRequest(_only(still, one), _only(goal, one), 1.0, own))
    width = np.ptp(single.control_points)
    assert planned.control_points[stuck] == pytest.approx(single.control_points[0], abs=1e-6 * width)
    for name in QUANTITIES:
        assert planned.report.extremes[name][stuck] == pytest.approx(single.report.extremes[name][0], rel=1e-4)
        assert (planned.report.margin[name] >= 0).all()


def _only(boundary: Boundary, joints: slice) -> Boundary:
    return Boundary(boundary.positions[joints], boundary.velocities[joints], boundary.accelerations[joints])


def test_infeasible_rows_of_the_second_plan_name_their_joint(strike: Primitive) -> None:
    """The third joint can reach its goal in time, but cannot come to rest behind it."""
    free, still = np.full(3, np.nan), np.zeros(3)
    three = fitted(TIMES, np.repeat(figure_strike(TIMES)[:, None], 3, axis=1))
    ranges = np.array([[-3.0, 3.0], [-3.0, 3.0], [-3.0, 0.548]])
    limits = Limits(ranges, np.array([99.0, 99.0, 20.0]), np.array([9e3, 9e3, 150.0]), np.array([1e6, 1e6, 1500.0]))
    goal = Boundary(np.full(3, 0.5), np.array([0.0, 0.0, 3.39]), free)
    request = MotionRequest(Boundary(still, still, still), goal, 0.289, limits)
    plan(three, replace(request, tail="coast"))
    with pytest.raises((Infeasible, OutOfTime)) as caught:
        plan(three, request)
    assert caught.value.joint == 2
    assert caught.value.min_duration is not None
    assert plan(three, replace(request, duration=caught.value.min_duration)).report.certified


def test_a_warm_plan_is_as_good_as_a_cold_one(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    near = plan(strike, ask(goal=(-0.95, 9.5), duration=1.02, limits=paper_limits)).warm
    request = ask(goal=(-1.0, 10.0), limits=paper_limits)
    cold, warm = plan(strike, request), plan(strike, request, warm=near)
    assert warm.report.certified
    assert warm.report.imitation_rms[0] == pytest.approx(cold.report.imitation_rms[0], rel=2e-3)
    assert np.abs(warm.control_points - cold.control_points).max() < 1e-3
    # A warm start from the same request's rows needs no search for them.
    assert plan(strike, request, warm=cold.warm).report.rounds <= 2


def test_a_warm_start_that_fails_is_followed_by_a_cold_start(
    strike: Primitive, ask: Ask, paper_limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A warm start imposes rows that this motion may not need, so its failure decides nothing."""
    request = ask(goal=(-1.0, 10.0), limits=paper_limits)
    cold = plan(strike, request)
    tried = []
    for failure in (InfeasibleRows(0, 1, 0.5), SolverFailed(0, "no end")):

        def only_cold(problem, effort, warm=None, joints=None, failure=failure, **more):
            tried.append(warm is not None)
            if warm is not None:
                raise failure
            return constraint_generation.solve(problem, effort, warm, joints, **more)

        monkeypatch.setattr(optimum, "solve", only_cold)
        assert plan(strike, request, warm=cold.warm).control_points.tobytes() == cold.control_points.tobytes()
    assert tried == [True, False] * 2


def test_a_warm_start_with_another_hull_is_ignored(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    """A waypoint on its limit changes the hull, and with it the indices of rows."""
    turning = Waypoint(0.5, np.array([2.0]), FREE)
    other = plan(strike, ask(limits=paper_limits, waypoints=(turning,))).warm
    request = ask(goal=(-1.0, 10.0), limits=paper_limits)
    cold = plan(strike, request)
    assert other.points != cold.warm.points
    assert plan(strike, request, warm=other).control_points.tobytes() == cold.control_points.tobytes()


def test_a_large_rest_fraction_meets_its_goal(strike: Primitive, ask: Ask) -> None:
    """Large weights cancel each other, so only rounding errors may remain in the equalities."""
    for goal in np.linspace(-1.0, 1.0, 21):
        hasty = ask(start=(0.5, 0.0), goal=(float(goal), 0.0), duration=10.0, rest_fraction=0.99)
        assert plan(strike, hasty).report.final_error_positions[0] < 1e-7


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


def test_basis_functions_are_added_for_close_waypoints(strike: Primitive, ask: Ask) -> None:
    """If waypoints are closer than two knot intervals of the demonstration, each interval is split."""

    def through(count: int) -> tuple[Waypoint, ...]:
        return tuple(Waypoint((k + 1) / (count + 1), np.zeros(1), FREE) for k in range(count))

    for count, functions in ((20, 50), (51, 3 + 47 * 3)):
        planned = plan(strike, ask(goal=(0.0, 1.0), waypoints=through(count)))
        assert planned.report.basis_count == functions
        assert np.abs(planned.sample(np.arange(1, count + 1) / (count + 1)).positions).max() < 1e-9


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


def test_coasting_continues_at_the_final_velocity(strike: Primitive, ask: Ask) -> None:
    planned = plan(strike, ask(tail="coast"))
    assert planned.total_duration == pytest.approx(1.0)
    later = planned.sample(np.array([1.5]))
    assert later.positions[0, 0] == pytest.approx(1.0 + 0.5 * 3.0)
    assert later.velocities[0, 0] == 3.0
    assert later.accelerations[0, 0] == 0.0


def test_samples_lie_on_the_tick_and_end_at_rest(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    planned = plan(strike, ask(limits=paper_limits, goal=(1.0, 5.0)), tick=0.002)
    samples = planned.samples()
    assert planned.total_duration > planned.duration
    assert planned.total_duration / 0.002 == pytest.approx(round(planned.total_duration / 0.002), abs=1e-9)
    assert len(samples) == round(planned.total_duration / 0.002) + 1
    assert samples.velocities[-1, 0] == 0
    assert samples.accelerations[-1, 0] == 0
    assert samples.positions[planned.hit_index, 0] == pytest.approx(1.0, abs=1e-10)


BOUNDARY_CASES: dict[str, tuple[dict[str, object], dict[str, object]]] = {
    "final velocity on its limit": ({"goal": (1.0, 11.0)}, {"velocities": 11.0}),
    "goal on the position limit, at rest": ({"goal": (1.0, 0.0)}, {"high": 1.0}),
    "start on the position limit, at rest": ({"start": (0.0, 0.0, 0.0), "goal": (-1.0, 0.0)}, {"high": 0.0}),
    "held on the limit": ({"start": (0.0, 0.0, 0.0), "goal": (0.0, 0.0)}, {"high": 0.0}),
    "start acceleration on its limit": ({"start": (0.0, 0.0, 300.0), "goal": (-1.0, 0.0)}, {}),
    "start velocity on its limit": ({"start": (0.0, 15.0, -100.0), "goal": (1.9, 0.0)}, {}),
    "waypoint on the limit": ({"waypoints": (Waypoint(0.5, np.array([2.0]), np.zeros(1)),)}, {}),
    "waypoint on the limit, free velocity": ({"waypoints": (Waypoint(0.5, np.array([1.5]), FREE),)}, {"high": 1.5}),
    "waypoint off the grid, on the limit": ({"waypoints": (Waypoint(0.50037, np.array([1.5]), FREE),)}, {"high": 1.5}),
    "waypoint's velocity on its limit": ({"waypoints": (Waypoint(0.5, FREE, np.array([9.0])),)}, {"velocities": 9.0}),
    "goal a float32 beyond its limit": ({"goal": (float(np.float32(1.1)), 0.0)}, {"high": 1.1}),
    "goal just inside": ({"goal": (1.0 - 1e-12, 0.0)}, {"high": 1.0}),
    "start of a phase on the limit": ({"start": (0.0, 0.0, 0.0), "goal": (-1.0, 0.0), "phase": 0.3}, {"high": 0.0}),
    "goal on the limit, with a place time": ({"goal": (1.0, 0.0), "place_time": 0.1}, {"high": 1.0}),
}


@pytest.mark.parametrize("name", BOUNDARY_CASES)
def test_values_exactly_on_their_limits_are_planned(strike: Primitive, ask: Ask, name: str) -> None:
    case, tight = BOUNDARY_CASES[name]
    limits = Limits(
        np.array([[-3.0, tight.get("high", 2.0)]]),
        np.array([tight.get("velocities", 15.0)]),
        np.array([300.0]),
        np.array([15000.0]),
    )
    report = plan(strike, ask(limits=limits, **case)).report
    assert report.certified
    for k, quantity in enumerate(QUANTITIES):
        assert report.margin[quantity][0] >= -1e-6 * np.ptp(limits.ranges[0, k]), quantity


def test_a_start_up_to_0_02_rad_outside_returns_inside_the_limits(strike: Primitive, ask: Ask) -> None:
    limits = Limits(np.array([[-3.0, 0.0]]), np.array([15.0]), np.array([300.0]), np.array([15000.0]))
    planned = plan(strike, ask(start=(0.015, 0.0, 0.0), goal=(-1.0, 0.0), limits=limits))
    positions = planned.sample(np.linspace(0, 1, 1001)).positions[:, 0]
    assert positions[:200].max() <= 0.015 + 1e-9
    assert not planned.report.certified
    assert positions[200:].max() <= 0
    with pytest.raises(LimitExceeded, match=r"position 0\.021 rad of the start lies"):
        plan(strike, ask(start=(0.021, 0.0, 0.0), goal=(-1.0, 0.0), limits=limits))


@pytest.mark.parametrize(
    ("case", "quantity", "value", "bound"),
    [
        ({"goal": (2.1, 0.0)}, "position", 2.1, 2.0),
        ({"goal": (1.0, -15.5)}, "velocity", -15.5, -15.0),
        ({"goal": (1.0, 3.0, 301.0)}, "acceleration", 301.0, 300.0),
        ({"start": (0.0, 16.0)}, "velocity", 16.0, 15.0),
        ({"start": (0.0, 1.0, -400.0)}, "acceleration", -400.0, -300.0),
        ({"waypoints": (Waypoint(0.5, np.array([-2.5]), np.array([np.nan])),)}, "position", -2.5, -2.0),
        ({"goal": (2.0 + 5e-6, 0.0)}, "position", 2.0 + 5e-6, 2.0),
    ],
)
def test_a_fixed_value_outside_its_limit_is_refused(
    strike: Primitive,
    ask: Ask,
    paper_limits: Limits,
    case: dict[str, object],
    quantity: str,
    value: float,
    bound: float,
) -> None:
    with pytest.raises(LimitExceeded) as refusal:
        plan(strike, ask(limits=paper_limits, tail="coast", **case))
    assert (refusal.value.joint, refusal.value.quantity) == (0, quantity)
    assert (refusal.value.value, refusal.value.bound) == (value, bound)


def test_a_goal_outside_its_limits_is_not_reported_as_cannot_stop(
    strike: Primitive, ask: Ask, paper_limits: Limits
) -> None:
    for goal in ((2.1, 5.0), (1.0, 16.0), (1.0, 3.0, 301.0)):
        with pytest.raises(LimitExceeded):
            plan(strike, ask(goal=goal, limits=paper_limits))


def test_the_velocity_named_by_cannot_stop_is_accepted(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    with pytest.raises(CannotStop) as refusal:
        plan(strike, ask(goal=(1.9, 10.0), limits=paper_limits))
    top = refusal.value.max_velocity
    assert top is not None
    # From a_f = −A the stop takes v²/2A + A³/24J² rad of the room, since A²/2J = 3 < v.
    room, a, j = 0.1, 300.0, 15000.0
    assert top == pytest.approx(np.sqrt(2 * a * (room - a**3 / (24 * j**2))), rel=1e-5)
    assert plan(strike, ask(goal=(1.9, 0.999 * top), limits=paper_limits)).report.certified
    with pytest.raises(CannotStop):
        plan(strike, ask(goal=(1.9, 1.001 * top), limits=paper_limits))


def test_a_final_acceleration_that_allows_no_stop_is_refused(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    """From 200 rad/s² even a joint at rest travels 200³/3J² = 0.012 rad while the jerk limit brings it to 0."""
    with pytest.raises(CannotStop, match="leave it free") as refusal:
        plan(strike, ask(goal=(1.99, 1.0, 200.0), limits=paper_limits))
    assert refusal.value.max_velocity is None


def test_a_braking_final_acceleration_bounds_the_velocity_on_both_sides(ask: Ask, paper_limits: Limits) -> None:
    """Faster motions pass the upper position limit, slower ones the lower; the refusal names the fastest that works."""
    narrow = replace(paper_limits, positions=np.array([[-0.01, 0.05]]))

    def hit(velocity: float) -> np.ndarray:
        return final_accelerations(ask(goal=(0.0, velocity, -200.0), limits=narrow))

    with pytest.raises(CannotStop) as refusal:
        hit(8.0)
    top = refusal.value.max_velocity
    assert top is not None
    assert 4 < top < 8
    assert np.array_equal(hit(top), [[-200.0, -200.0]])
    for velocity in (1.0001 * top, 0.0):
        with pytest.raises(CannotStop):
            hit(velocity)


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


def test_a_mismatched_joint_count_is_refused(strike: Primitive, ask: Ask) -> None:
    free = np.full(2, np.nan)
    ends = Boundary(np.zeros(2), np.zeros(2), free)
    with pytest.raises(InvalidMotion, match="primitive"):
        plan(strike, MotionRequest(ends, ends, 1.0, Limits.unlimited(2)))
    with pytest.raises(InvalidMotion, match="warm"):
        plan(strike, ask(), warm=Warm(578, [np.zeros(0, dtype=int)] * 2))


@pytest.mark.parametrize("part", [0.5, 0.99, 1.02, -1.0])
def test_a_wrong_solution_never_becomes_a_plan_beyond_limits(
    strike: Primitive, ask: Ask, paper_limits: Limits, monkeypatch: pytest.MonkeyPatch, part: float
) -> None:
    """The solver reports success with multipliers scaled by `part`."""
    exact = constraint_generation.least_distance

    def scaled(*program: object, **more: object) -> tuple[np.ndarray, str]:
        multipliers, status = exact(*program, **more)  # type: ignore[arg-type]
        return part * multipliers, status

    monkeypatch.setattr(constraint_generation, "least_distance", scaled)
    try:
        planned = plan(strike, ask(goal=(-1.0, 10.0), limits=paper_limits))
    except MotionError:
        assert part != 1.02
        return
    assert part == 1.02  # worse than the optimum, but feasible
    assert all(planned.report.margin[name][0] >= 0 for name in QUANTITIES)


def test_a_solution_that_violates_the_equalities_is_refused(
    strike: Primitive, ask: Ask, paper_limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    def shifted(*args: object, **more: object) -> Solution:
        found = constraint_generation.solve(*args, **more)  # type: ignore[arg-type]
        return replace(found, x=found.x * (1 + 1e-8))

    monkeypatch.setattr(optimum, "solve", shifted)
    with pytest.raises(SolverFailed, match="equalities are off"):
        plan(strike, ask(goal=(-1.0, 10.0), limits=paper_limits))


def test_effort_is_bounded_and_the_refusal_deterministic(moves: Primitive) -> None:
    """Six joints with fast waypoints and tight jerk limits, which would take long without a bound."""
    rng = np.random.default_rng(5)
    six = replace(moves, control_points=np.repeat(moves.control_points, 6, axis=0), spread=np.empty((6, 0)))
    still, free = np.zeros(6), np.full(6, np.nan)
    limits = Limits(np.array([[-2.0, 2.0]] * 6), np.full(6, 1.0), np.full(6, 2.0), np.full(6, 8.0))
    through = tuple(Waypoint(2.0 + 2 * k, rng.uniform(-1.5, 1.5, 6), free) for k in range(8))
    ends = Boundary(still, still, still), Boundary(np.full(6, 0.7), still, free)
    request = MotionRequest(*ends, 20.0, limits, through)
    answers = []
    for _ in range(2):
        with pytest.raises((Infeasible, SolverFailed)) as caught:
            plan(six, request)
        answers.append(str(caught.value))
        if isinstance(caught.value, SolverFailed):
            assert caught.value.status == "time"
    assert answers[0] == answers[1]


def test_fewer_basis_functions_are_used_where_limits_are_active_everywhere() -> None:
    """Seven joints of 200 functions, planned at two durations."""
    t = np.linspace(0, 4, 1001)
    strokes = np.linspace(0.02, 0.05, 7) * (1 - np.cos(6 * np.pi * t))[:, None]
    rich = fitted(t, strokes + np.linspace(0.2, 0.6, 7) * np.sin(np.pi * t / 4)[:, None] ** 2, 200)
    still, free = np.zeros(7), np.full(7, np.nan)
    limits = Limits(np.array([[-2.0, 2.0]] * 7), np.full(7, 2.0), np.full(7, 10.0), np.full(7, 300.0))
    ends = Boundary(rich.start.positions, still, still), Boundary(rich.goal.positions, still, free)
    slow, fast = (plan(rich, MotionRequest(*ends, duration, limits)) for duration in (6.0, 3.0))
    assert slow.report.basis_count == 200 > fast.report.basis_count
    assert all((margin > -1e-9).all() for margin in fast.report.margin.values())
    assert (fast.report.from_demonstration.max < 0.3).all()
    # A duration that is far too short is refused with one that works.
    with pytest.raises((Infeasible, OutOfTime)) as caught:
        plan(rich, MotionRequest(*ends, 0.3, limits))
    assert caught.value.min_duration is not None
    plan(rich, MotionRequest(*ends, caught.value.min_duration, limits))


def test_exhausted_effort_has_the_status_time(
    strike: Primitive, ask: Ask, paper_limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plan_module, "EFFORT", 10.0)
    with pytest.raises(SolverFailed) as caught:
        plan(strike, ask(goal=(-1.0, 10.0), limits=paper_limits))
    assert caught.value.status == "time"


def test_planning_is_deterministic_to_the_bit(strike: Primitive, ask: Ask, paper_limits: Limits) -> None:
    request = ask(goal=(-1.0, 10.0), limits=paper_limits)
    one, two = (plan(strike, request).samples() for _ in range(2))
    assert one.positions.tobytes() == two.positions.tobytes()
    assert one.accelerations.tobytes() == two.accelerations.tobytes()


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


def test_infeasible_lists_five_waypoint_times_and_counts_the_others() -> None:
    error = Infeasible(0, "jerk", 0.25, 2.0, [0.02 * k for k in range(1, 99)])
    assert str(error).endswith("works with waypoints at 0.02 s, 0.04 s, 0.06 s, 0.08 s, 0.1 s and 93 more")
    assert len(error.waypoint_times or []) == 98
