"""Plans of single cases whose answer is known some other way."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from motion import plan as plan_module
from motion import solver as solver_module
from motion.basis import make_basis
from motion.demonstration import Demonstration
from motion.errors import CannotStop, Infeasible, InvalidMotion, LimitExceeded, SolverFailed
from motion.limits import Limits
from motion.plan import Warm, plan
from motion.primitive import Primitive, learn
from motion.problem import BAND
from motion.request import Boundary, MotionRequest, Waypoint
from motion.stopping import final_accelerations

Ask = Callable[..., MotionRequest]

LIMITED = ("positions", "velocities", "accelerations", "jerks")


def test_without_limits_the_optimum_is_the_demonstration_plus_a_line(figure: Primitive, ask: Ask) -> None:
    """Over all functions the optimum of eq. 10 is τ²d̈ plus a straight line in t (design 1.2)."""
    request = ask(start=(0.2, 0.0), goal=(1.3, 6.0), duration=0.8, tail="coast")
    planned = plan(figure, request)
    t = np.linspace(0, 0.8, 1001)
    imitated = figure.accelerations[:, 0] / 0.64
    # The line a + bt follows from the two end conditions.
    step = t[1]
    velocity = np.concatenate([[0], np.cumsum((imitated[1:] + imitated[:-1]) / 2 * step)])
    position = np.concatenate([[0], np.cumsum((velocity[1:] + velocity[:-1]) / 2 * step)])
    gained, travelled = 6.0 - velocity[-1], 1.1 - position[-1]
    line = np.linalg.solve([[0.8, 0.8**2 / 2], [0.8**2 / 2, 0.8**3 / 6]], [gained, travelled])
    optimum = imitated + line[0] + line[1] * t
    found = planned.sample(t).accelerations[:, 0]
    # No 50 functions of this width come nearer to this optimum, in closed form, than 0.936 %, most of it at the ends.
    missed = np.sqrt(np.trapezoid((found - optimum) ** 2, t) / np.trapezoid(optimum**2, t))
    assert missed == pytest.approx(0.0094, abs=2e-4)
    missed = np.sqrt(np.trapezoid((found - imitated) ** 2, t) / 0.8)
    assert planned.report.imitation_rms[0] == pytest.approx(missed, rel=2e-4)


def test_duration_free_problem_is_the_one_built_afresh_in_real_time(figure: Primitive, ask: Ask) -> None:
    """Eq. 8–16 written in t for this duration, with the errors of design 1.3 mended: the same positions."""
    duration, start, goal = 0.8, (0.2, 0.5), (1.3, 6.0)
    basis = make_basis(50)
    t = np.linspace(0, duration, 8001)
    psi = basis.rows(t / duration, 0)
    weights = np.full(len(t), t[1])
    weights[[0, -1]] /= 2
    gram = psi.T @ (psi * weights[:, None])
    tau = 1.0 / duration
    demonstrated = make_interp_spline(np.linspace(0, 1, 1001), figure.accelerations[:, 0], k=5)(t / duration)
    theta = psi.T @ (weights * tau**2 * demonstrated)
    once = duration * basis.rows(t / duration, -1)
    twice = duration**2 * basis.rows(t / duration, -2)
    rows = np.stack([twice[-1], once[-1]])
    targets = [goal[0] - start[0] - duration * start[1], goal[1] - start[1]]
    kkt = np.block([[gram, rows.T], [rows, np.zeros((2, 2))]])
    w = np.linalg.solve(kkt, np.concatenate([theta, targets]))[:50]
    expected = start[0] + t * start[1] + twice @ w
    found = plan(figure, ask(start, goal, duration, tail="coast")).sample(t).positions[:, 0]
    assert np.abs(found - expected).max() < 1e-6


@pytest.mark.parametrize(
    "case",
    [
        {"duration": 0.8, "goal": (1.0, 6.0)},  # figure 2: other end velocity and duration
        {"goal": (-1.0, 10.0)},  # figure 3: the position limit shapes the motion
        {"goal": (-1.0, 10.0), "duration": 0.8, "start": (0.2, 0.0, 0.0)},
        {"waypoints": (Waypoint(0.5, np.array([1.0]), np.array([1.0])),)},  # figure 4
    ],
)
def test_the_papers_cases(figure: Primitive, ask: Ask, paper_limits: Limits, case: dict[str, object]) -> None:
    planned = plan(figure, ask(limits=paper_limits, **case))
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


def test_an_active_limit_is_named_where_it_binds(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    planned = plan(figure, ask(goal=(-1.0, 10.0), limits=paper_limits))
    times = np.linspace(0, 1, 1001)
    lowest = times[planned.sample(times).positions[:, 0].argmin()]
    positions = [a for a in planned.report.active if a.quantity == "position"]
    assert len(positions) == 1
    assert positions[0].time_from_start == pytest.approx(lowest, abs=0.005)
    assert planned.report.rounds >= 1
    assert planned.report.rows >= 1


def test_joints_are_planned_as_if_alone(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    t = np.linspace(0, 1, 1001)
    strike = figure.demonstrated_positions(t)[:, 0]
    both = learn(Demonstration(t, np.stack([strike, np.sin(t)], axis=1)))
    alone = learn(Demonstration(t, strike[:, None]))
    two = Limits(*(np.repeat(getattr(paper_limits, f), 2, axis=0) for f in LIMITED))
    free = np.full(2, np.nan)
    request = MotionRequest(
        Boundary(np.zeros(2), np.zeros(2), free), Boundary(np.array([-1.0, 0.5]), np.array([10.0, 0.0]), free), 1.0, two
    )
    planned = plan(both, request)
    single = plan(alone, ask(start=(0.0, 0.0), goal=(-1.0, 10.0), limits=paper_limits))
    times = np.linspace(0, 1, 100)
    assert np.allclose(planned.sample(times).positions[:, 0], single.sample(times).positions[:, 0], atol=1e-6)
    assert {a.joint for a in planned.report.active} == {0}
    assert planned.report.imitation_rms.shape == (2,)
    assert planned.warm.curves.shape == (2, 6, 1001)


@pytest.mark.parametrize("stuck", [0, 1, 2])
def test_only_the_joint_that_could_not_stop_is_planned_again(
    figure: Primitive, stuck: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And as it would be alone, wherever it stands among the others."""
    t, free = np.linspace(0, 1, 1001), np.full(3, np.nan)
    strike = figure.demonstrated_positions(t)
    sizes = np.array([1.0, 0.7, 0.5])
    together = learn(Demonstration(t, strike * sizes))
    alone = learn(Demonstration(t, strike * sizes[stuck]))
    # A hand's breadth behind the goal for one joint, room enough for the others.
    highest = np.where(np.arange(3) == stuck, 0.535, 1.5)
    limits = Limits(
        np.stack([np.full(3, -3.0), highest], axis=1), np.full(3, 20.0), np.full(3, 200.0), np.full(3, 5000.0)
    )
    still, goal = Boundary(np.zeros(3), np.zeros(3), np.zeros(3)), Boundary(np.full(3, 0.5), np.full(3, 2.0), free)
    request = MotionRequest(still, goal, 1.0, limits)
    planned_joints = []
    solve = plan_module.solve

    def noting(*args: object) -> list[solver_module.Solution]:
        planned_joints.append(args[-1])
        return solve(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(plan_module, "solve", noting)
    planned = plan(together, request)
    assert [joints.tolist() for joints in planned_joints] == [[0, 1, 2], [stuck]]
    one = slice(stuck, stuck + 1)
    own = Limits(limits.positions[one], limits.velocities[one], limits.accelerations[one], limits.jerks[one])
    single = plan(alone, MotionRequest(_only(still, one), _only(goal, one), 1.0, own))
    assert planned.weights[stuck] == pytest.approx(single.weights[0], abs=1e-9 * np.abs(single.weights).max())
    assert np.isfinite(planned.curves).all()
    for name in ("position", "velocity", "acceleration", "jerk"):
        assert planned.report.extremes[name][stuck] == pytest.approx(single.report.extremes[name][0], rel=1e-9)
        assert (planned.report.margin[name] >= 0).all()


def _only(boundary: Boundary, joints: slice) -> Boundary:
    return Boundary(boundary.positions[joints], boundary.velocities[joints], boundary.accelerations[joints])


def test_a_clash_of_the_second_plan_names_its_joint(figure: Primitive) -> None:
    """The third joint could reach its goal in time, but not so that it comes to rest behind it."""
    t, free, still = np.linspace(0, 1, 1001), np.full(3, np.nan), np.zeros(3)
    three = learn(Demonstration(t, np.repeat(figure.demonstrated_positions(t), 3, axis=1)))
    ranges = np.array([[-3.0, 3.0], [-3.0, 3.0], [-3.0, 0.548]])
    limits = Limits(ranges, np.full(3, 20.0), np.full(3, 150.0), np.full(3, 1500.0))
    goal = Boundary(np.full(3, 0.5), np.array([0.0, 0.0, 3.39]), free)
    request = MotionRequest(Boundary(still, still, still), goal, 0.289, limits)
    plan(three, replace(request, tail="coast"))
    with pytest.raises(Infeasible) as caught:
        plan(three, request)
    assert (caught.value.joint, caught.value.quantity) == (2, "jerk")
    assert caught.value.min_duration is not None
    assert plan(three, replace(request, duration=caught.value.min_duration)).report.certified


def test_a_warm_plan_is_as_good_as_a_cold_one(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    """Both may use up the band in their own way, so they differ by millimetres, but not in what they miss: the optimum
    of limits wider by the band misses less, that of limits narrower by it more."""

    def within(part: float) -> Limits:
        return Limits(*(part * getattr(paper_limits, name) for name in LIMITED))

    def missed(limits: Limits, warm: Warm | None = None) -> float:
        planned = plan(figure, ask(goal=(-1.0, 10.0), limits=limits), warm=warm)
        assert planned.report.certified
        return float(planned.report.imitation_rms[0])

    near = plan(figure, ask(goal=(-0.95, 9.5), duration=1.02, limits=paper_limits)).warm
    least, most = missed(within(1 / (1 - BAND))), missed(within(1 - BAND))
    assert least < most
    assert least <= missed(paper_limits) <= most
    assert least <= missed(paper_limits, near) <= most


def test_no_verdict_rests_on_the_rows_of_an_earlier_motion(
    figure: Primitive, ask: Ask, paper_limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are demanded where this motion might do without: what fails with them is tried without."""
    request = ask(goal=(-1.0, 10.0), limits=paper_limits)
    cold = plan(figure, request)
    for failure in (solver_module.Clash(0, 1, 0.5), SolverFailed(0, "no end")):

        def only_cold(grid, problem, warm, joints, failure=failure):
            if warm is not None:
                raise failure
            return solver_module.solve(grid, problem, warm, joints)

        monkeypatch.setattr(plan_module, "solve", only_cold)
        assert plan(figure, request, warm=cold.warm).curves.tobytes() == cold.curves.tobytes()


def test_a_motion_that_is_over_at_once(figure: Primitive, ask: Ask) -> None:
    """Its weights are large and cancel each other; what is left of the equalities is their rounding."""
    for goal in np.linspace(-1.0, 1.0, 21):
        hasty = ask(start=(0.5, 0.0), goal=(float(goal), 0.0), duration=10.0, rest_fraction=0.99)
        assert plan(figure, hasty).report.final_error_positions[0] < 1e-7


def test_more_values_than_a_motion_can_meet(figure: Primitive, ask: Ask) -> None:
    def through(count: int) -> tuple[Waypoint, ...]:
        return tuple(Waypoint((k + 1) / (count + 1), np.zeros(1), FREE) for k in range(count))

    plan(figure, ask(goal=(0.0, 1.0), waypoints=through(20)))
    with pytest.raises(InvalidMotion, match=r"fix, with both ends, 53 values of a joint; at most 50 can be met"):
        plan(figure, ask(goal=(0.0, 1.0), waypoints=through(51)))


def test_rest_fraction_ends_in_a_straight_line(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    planned = plan(figure, ask(limits=paper_limits, rest_fraction=0.2))
    last = planned.sample(np.linspace(0.8, 1.0, 50)[1:])
    assert np.all(last.accelerations == 0)
    assert np.all(last.velocities == 3.0)
    assert last.positions[-1, 0] == 1.0
    join = planned.sample(np.array([0.8 - 1e-9, 0.8, 0.8 + 1e-9]))
    for values in (join.positions, join.velocities, join.accelerations):
        assert np.ptp(values) < 1e-4


def test_coasting_goes_on_at_the_final_velocity(figure: Primitive, ask: Ask) -> None:
    planned = plan(figure, ask(tail="coast"))
    assert planned.total_duration == pytest.approx(1.0)
    later = planned.sample(np.array([1.5]))
    assert later.positions[0, 0] == pytest.approx(1.0 + 0.5 * 3.0)
    assert later.velocities[0, 0] == 3.0
    assert later.accelerations[0, 0] == 0.0


def test_samples_lie_on_the_tick_and_end_at_rest(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    planned = plan(figure, ask(limits=paper_limits, goal=(1.0, 5.0)), tick=0.002)
    samples = planned.samples()
    assert planned.total_duration > planned.duration
    assert planned.total_duration / 0.002 == pytest.approx(round(planned.total_duration / 0.002), abs=1e-9)
    assert len(samples) == round(planned.total_duration / 0.002) + 1
    assert samples.velocities[-1, 0] == 0
    assert samples.accelerations[-1, 0] == 0
    assert samples.positions[planned.hit_index, 0] == pytest.approx(1.0, abs=1e-10)


FREE = np.full(1, np.nan)

BOUNDARY_CASES: dict[str, tuple[dict[str, object], dict[str, object]]] = {
    "final velocity on its limit": ({"goal": (1.0, 11.0)}, {"velocities": 11.0}),
    "goal on the position limit, at rest": ({"goal": (1.0, 0.0)}, {"high": 1.0}),
    "start on the position limit, at rest": ({"start": (0.0, 0.0, 0.0), "goal": (-1.0, 0.0)}, {"high": 0.0}),
    "held on the limit": ({"start": (0.0, 0.0, 0.0), "goal": (0.0, 0.0)}, {"high": 0.0}),
    "start acceleration on its limit": ({"start": (0.0, 0.0, 300.0), "goal": (-1.0, 0.0)}, {}),
    "start velocity on its limit": ({"start": (0.0, 15.0, -100.0), "goal": (1.9, 0.0)}, {}),
    "way-point on the limit": ({"waypoints": (Waypoint(0.5, np.array([2.0]), np.zeros(1)),)}, {}),
    "way-point on the limit, free velocity": ({"waypoints": (Waypoint(0.5, np.array([1.5]), FREE),)}, {"high": 1.5}),
    "way-point off the grid, on the limit": ({"waypoints": (Waypoint(0.50037, np.array([1.5]), FREE),)}, {"high": 1.5}),
    "way-point's velocity on its limit": ({"waypoints": (Waypoint(0.5, FREE, np.array([9.0])),)}, {"velocities": 9.0}),
}


@pytest.mark.parametrize("name", BOUNDARY_CASES)
def test_values_exactly_on_their_limits(figure: Primitive, ask: Ask, name: str) -> None:
    case, tight = BOUNDARY_CASES[name]
    limits = Limits(
        np.array([[-3.0, tight.get("high", 2.0)]]),
        np.array([tight.get("velocities", 15.0)]),
        np.array([300.0]),
        np.array([15000.0]),
    )
    report = plan(figure, ask(limits=limits, **case)).report
    assert report.certified
    for quantity, margin in report.margin.items():
        assert margin[0] >= -2e-6 * np.ptp(limits.ranges[0], axis=1).max(), quantity


def test_a_start_outside_the_position_limits_is_led_back(figure: Primitive, ask: Ask) -> None:
    limits = Limits(np.array([[-3.0, 0.0]]), np.array([15.0]), np.array([300.0]), np.array([15000.0]))
    planned = plan(figure, ask(start=(0.015, 0.0, 0.0), goal=(-1.0, 0.0), limits=limits))
    positions = planned.sample(np.linspace(0, 1, 1001)).positions[:, 0]
    assert positions[:200].max() <= 0.015 + 1e-9
    assert positions[200:].max() <= 0
    with pytest.raises(LimitExceeded):
        plan(figure, ask(start=(0.021, 0.0, 0.0), goal=(-1.0, 0.0), limits=limits))


@pytest.mark.parametrize(
    ("case", "quantity", "value", "bound"),
    [
        ({"goal": (2.1, 0.0)}, "position", 2.1, 2.0),
        ({"goal": (1.0, -15.5)}, "velocity", -15.5, -15.0),
        ({"goal": (1.0, 3.0, 301.0)}, "acceleration", 301.0, 300.0),
        ({"start": (0.0, 16.0)}, "velocity", 16.0, 15.0),
        ({"start": (0.0, 1.0, -400.0)}, "acceleration", -400.0, -300.0),
        ({"waypoints": (Waypoint(0.5, np.array([-2.5]), np.array([np.nan])),)}, "position", -2.5, -2.0),
    ],
)
def test_fixed_values_outside_are_named(
    figure: Primitive,
    ask: Ask,
    paper_limits: Limits,
    case: dict[str, object],
    quantity: str,
    value: float,
    bound: float,
) -> None:
    with pytest.raises(LimitExceeded) as refusal:
        plan(figure, ask(limits=paper_limits, tail="coast", **case))
    assert (refusal.value.joint, refusal.value.quantity) == (0, quantity)
    assert (refusal.value.value, refusal.value.bound) == (value, bound)


def test_a_goal_outside_is_a_limit_and_not_a_stop(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    for goal in ((2.1, 5.0), (1.0, 16.0), (1.0, 3.0, 301.0)):
        with pytest.raises(LimitExceeded):
            plan(figure, ask(goal=goal, limits=paper_limits))


def test_the_velocity_named_by_cannot_stop_is_accepted(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    with pytest.raises(CannotStop) as refusal:
        plan(figure, ask(goal=(1.9, 10.0), limits=paper_limits))
    top = refusal.value.max_velocity
    assert top is not None
    # From a_f = −A the stop takes v²/2A + A³/24J² of the room; here A²/2J = 3 < v (design 1.9).
    room, a, j = 0.1, 300.0, 15000.0
    assert top == pytest.approx(np.sqrt(2 * a * (room - a**3 / (24 * j**2))), rel=1e-5)
    assert plan(figure, ask(goal=(1.9, 0.999 * top), limits=paper_limits)).report.certified
    with pytest.raises(CannotStop):
        plan(figure, ask(goal=(1.9, 1.001 * top), limits=paper_limits))


def test_a_final_acceleration_from_which_nothing_stops(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    """From 200 rad/s² even an arm at rest travels 200³/3J² = 0.012 rad until jerk has brought that to 0."""
    with pytest.raises(CannotStop, match="leave it free") as refusal:
        plan(figure, ask(goal=(1.99, 1.0, 200.0), limits=paper_limits))
    assert refusal.value.max_velocity is None


def test_a_braking_final_acceleration_wants_some_velocity(ask: Ask, paper_limits: Limits) -> None:
    """Too fast passes the upper limit, too slow swings back through the lower one: the fastest between is named."""
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


def test_too_short_a_duration_gets_the_shortest_that_works(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    waypoint = Waypoint(0.05, np.array([0.3]), np.array([np.nan]))
    hurried = ask(start=(0.0, 0.0, 0.0), duration=0.1, limits=paper_limits, waypoints=(waypoint,))
    with pytest.raises(Infeasible) as refusal:
        plan(figure, hurried)
    error = refusal.value
    assert error.min_duration is not None
    assert error.waypoint_times == pytest.approx([error.min_duration / 2])
    assert error.min_duration / 0.001 == pytest.approx(round(error.min_duration / 0.001), abs=1e-9)

    def at(duration: float) -> MotionRequest:
        return replace(hurried, duration=duration, waypoints=(replace(waypoint, time_from_start=duration / 2),))

    assert plan(figure, at(error.min_duration)).report.certified
    # One tick below, the solver may find the border itself inconclusive.
    with pytest.raises((Infeasible, SolverFailed)):
        plan(figure, at(error.min_duration - 0.001))
    with pytest.raises(Infeasible):
        plan(figure, at(error.min_duration - 0.003))


def test_impossible_at_any_duration(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    outward = Waypoint(0.5, np.array([2.0]), np.array([1.0]))
    with pytest.raises(Infeasible) as refusal:
        plan(figure, ask(limits=paper_limits, waypoints=(outward,)))
    assert refusal.value.min_duration is None
    assert refusal.value.time == pytest.approx(0.5, abs=0.02)


def test_mismatched_joints_are_refused(figure: Primitive, ask: Ask) -> None:
    free = np.full(2, np.nan)
    ends = Boundary(np.zeros(2), np.zeros(2), free)
    with pytest.raises(InvalidMotion, match="primitive"):
        plan(figure, MotionRequest(ends, ends, 1.0, Limits.unlimited(2)))
    with pytest.raises(InvalidMotion, match="warm"):
        plan(figure, ask(), warm=Warm(np.zeros((2, 6, 1001))))


def test_the_solver_is_not_believed(
    figure: Primitive, ask: Ask, paper_limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A solver that claims success with a wrong answer never becomes a plan."""
    honest = solver_module.shortest_step

    def liar(*program: object) -> tuple[np.ndarray, np.ndarray, str]:
        u, multipliers, status = honest(*program)  # type: ignore[arg-type]
        return 0.5 * u, multipliers, status

    monkeypatch.setattr(solver_module, "shortest_step", liar)
    with pytest.raises(SolverFailed, match="stay violated"):
        plan(figure, ask(goal=(-1.0, 10.0), limits=paper_limits))


def test_the_same_request_gives_the_same_bytes(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    request = ask(goal=(-1.0, 10.0), limits=paper_limits)
    one, two = (plan(figure, request).samples() for _ in range(2))
    assert one.positions.tobytes() == two.positions.tobytes()
    assert one.accelerations.tobytes() == two.accelerations.tobytes()
