"""Plans without a certificate: the check against limits covers the trajectory that is played."""

import numpy as np
import pytest

from motion.braking import stop
from motion.dmp_plan import plan_dmp
from motion.errors import LimitExceeded
from motion.gaussian import plan_gaussian
from motion.limits import Limits
from motion.primitive import Primitive
from motion.sampled import check_limits


def test_a_dmp_exceeds_the_position_limit_of_fig_3(figure: Primitive, ask, paper_limits: Limits):
    """It is planned with a negative margin, and `check_limits` refuses it."""
    made = plan_dmp(figure, ask(goal=(-1.0, 10.0), limits=paper_limits))
    assert made.report.margin["position"][0] < -0.1
    with pytest.raises(LimitExceeded) as caught:
        check_limits(made)
    assert caught.value.quantity == "position"


def test_velocity_acceleration_and_jerk_limits_are_checked(figure: Primitive, ask):
    """A plan that violates one of them is refused; the demonstration without limits passes."""
    names = ("velocities", "accelerations", "jerks")
    free = Limits.unlimited(1)
    check_limits(plan_dmp(figure, ask(start=(0.0, -1.0, float(figure.start.accelerations[0])), tail="coast")))
    for name, quantity, bound in zip(names, ("velocity", "acceleration", "jerk"), (5.0, 50.0, 500.0), strict=True):
        bounds = {n: np.array([bound if n == name else np.inf]) for n in names}
        made = plan_dmp(figure, ask(limits=Limits(free.positions, **bounds), tail="coast"))
        with pytest.raises(LimitExceeded) as caught:
            check_limits(made)
        assert (caught.value.quantity, caught.value.bound) in ((quantity, bound), (quantity, -bound))


def test_a_violation_of_the_upper_position_limit_alone_is_refused(figure: Primitive, ask):
    """The demonstration ends at 1 rad, its highest position."""
    free = np.array([np.inf])
    made = plan_dmp(figure, ask(limits=Limits(np.array([[-5.0, 0.5]]), free, free, free), tail="coast"))
    with pytest.raises(LimitExceeded) as caught:
        check_limits(made)
    assert caught.value.bound == 0.5
    assert caught.value.value > 0.99


@pytest.mark.parametrize("method", [plan_dmp, plan_gaussian])
def test_the_trajectory_is_twice_continuously_differentiable_and_ends_at_rest(
    figure: Primitive, ask, paper_limits: Limits, method
):
    made = method(figure, ask(goal=(0.5, 4.0), duration=0.9, limits=paper_limits))
    motion = made.trajectory
    lengths = np.diff(motion.breaks)[:-1, None]
    c, after = motion.coefficients[:-1].transpose(2, 0, 1), motion.coefficients[1:].transpose(2, 0, 1)
    powers = np.arange(6)
    position = (c * lengths ** powers[:, None, None]).sum(axis=0)
    velocity = (powers[1:, None, None] * c[1:] * lengths ** powers[:5, None, None]).sum(axis=0)
    factors = (powers[2:] * powers[1:5])[:, None, None]
    acceleration = (factors * c[2:] * lengths ** powers[:4, None, None]).sum(axis=0)
    assert np.abs(after[0] - position).max() < 1e-12
    assert np.abs(after[1] - velocity).max() < 1e-9
    assert np.abs(2 * after[2] - acceleration).max() < 1e-6
    assert not motion.coefficients[-1, :, 1:].any()
    assert made.total_duration >= motion.duration


def test_extremes_include_those_between_samples(figure: Primitive, ask):
    made = plan_gaussian(figure, ask(start=(0.5, -1.0), goal=(1.0, 5.0), duration=0.8, tail="coast"))
    x = np.linspace(0, 1, 41) * 0.8 / 1000
    c = made.trajectory.coefficients[:-1, 0]
    jerks = np.polynomial.polynomial.polyval(x, (c[:, 3:] * [6, 24, 60]).T)
    # The jerk jumps slightly between pieces, hence the tolerance.
    assert made.report.extremes["jerk"][0] == pytest.approx([jerks.min(), jerks.max()], rel=1e-5)


def test_a_follow_through_keeps_the_final_velocity(figure: Primitive, ask, paper_limits: Limits):
    made = plan_gaussian(figure, ask(limits=paper_limits, goal=(0.5, 3.0), follow_through=0.1))
    after = made.sample(np.linspace(1.0, 1.1, 50)[1:-1])
    assert np.allclose(after.velocities, 3.0)
    assert not after.accelerations.any()
    rest = stop(np.array([0.8]), np.array([3.0]), np.zeros(1), paper_limits)
    assert made.samples().positions[-1, 0] == pytest.approx(rest.sample(rest.breaks[-1:]).positions[0][0], abs=1e-9)
