"""The stop after the goal: its place in the plan, and final states that allow none."""

from dataclasses import replace

import numpy as np
import pytest

from motion.errors import CannotStop, Infeasible, OutOfTime
from motion.limits import QUANTITIES, Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.program import optimum
from motion.program.constraint_generation import Solution
from motion.program.terminal_set import final_accelerations
from motion.request import Boundary, MotionRequest
from tests.splines_of import TIMES, figure_strike, fitted, joint_of
from tests.unit.motion.asking import Ask


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
