"""The paper's formulation: its optimum compared with CVXOPT, limits and report of its plans, and refusals."""

from dataclasses import replace

import numpy as np
import pytest

from motion.errors import CannotStop, Infeasible, InvalidMotion, LimitExceeded
from motion.gaussian import SAFETY_MARGIN, optimum, optimum_without_limits, plan_gaussian
from motion.gaussian_program import INSTANTS, GaussianProgram, make_programs, rows
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest, Waypoint
from motion.sampled import check_limits
from tests.unit.motion.asking import FREE, Ask

TOLERANCE = 1e-7
"""Violations up to this part of a limit's range are within the solver's tolerance."""

CASES: dict[str, dict] = {
    "fig. 2": {"start": (0.5, -1.0), "goal": (1.0, 5.0), "duration": 0.8},
    "fig. 3": {"goal": (-1.0, 10.0), "tail": "coast"},
    "fig. 4": {"waypoints": (Waypoint(0.5, np.array([1.0]), np.array([-3.0])),), "tail": "coast"},
    "everything": {"goal": (-1.0, 10.0, -50.0), "waypoints": (Waypoint(0.3037, np.array([-1.5]), FREE),)},
    "rest": {"goal": (0.0, 1.0), "rest_fraction": 0.1},
    "phase": {"start": (-1.0, 3.0, 20.0), "phase": 0.4, "duration": 0.5},
}


def program_of(primitive: Primitive, request: MotionRequest) -> GaussianProgram:
    """Return the quadratic program of a single-joint request."""
    return make_programs(primitive, request, 50)[0]


@pytest.mark.parametrize("name", CASES)
def test_the_optimum_agrees_with_cvxopt(figure: Primitive, ask: Ask, paper_limits: Limits, name: str) -> None:
    """The paper's solver finds the same cost to 1e-6 and the same acceleration to 0.1 % of its peak."""
    cvxopt = pytest.importorskip("cvxopt", reason="the extra `paper` is not installed")
    request = ask(**CASES[name], limits=paper_limits)
    program = program_of(figure, request)
    inequalities = np.concatenate([program.G, -program.G]), np.concatenate([program.high, -program.low])
    matrices = [cvxopt.matrix(x) for x in (program.P, program.c, *inequalities, program.A, program.b)]
    options = {"show_progress": False, "abstol": 1e-10, "reltol": 1e-10, "feastol": 1e-10}
    theirs = np.array(cvxopt.solvers.qp(*matrices, options=options)["x"])[:, 0]
    ours = optimum(program, 0)
    whole = figure.sample(INSTANTS).accelerations
    spent = float(np.mean(whole**2))

    def cost(w: np.ndarray) -> float:
        return float(w @ program.P @ w / 2 + program.c @ w)

    assert abs(cost(ours) - cost(theirs)) < 1e-6 * spent
    accelerations = rows(50)[2] @ np.array([ours, theirs]).T
    assert np.abs(accelerations[:, 0] - accelerations[:, 1]).max() < 1e-3 * np.abs(accelerations).max()


def test_limits_hold_at_every_sample_of_the_program(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    request = ask(goal=(-1.0, 10.0), limits=paper_limits)
    program = program_of(figure, request)
    w = optimum(program, 0)
    values = program.G @ w
    width = np.ptp(paper_limits.ranges[0], axis=1)[program.quantity]
    assert np.all(values >= program.low - TOLERANCE * width)
    assert np.all(values <= program.high + TOLERANCE * width)
    assert np.abs(program.A @ w - program.b).max() < 1e-12
    assert len(program.G) == 4 * 1001 - 4  # without position and velocity of start and goal
    assert np.abs(optimum_without_limits(program) - w).max() > 1


@pytest.mark.parametrize("name", CASES)
def test_the_trajectory_is_the_optimum_and_meets_goal_and_waypoints(figure: Primitive, ask: Ask, name: str) -> None:
    """Quintics between samples approximate the sum of Gaussians to 1e-6 of its peak."""
    request = ask(**CASES[name])
    made = plan_gaussian(figure, request)
    end = made.sample(np.array([request.duration]))
    assert end.positions[0] == pytest.approx(request.goal.positions, abs=1e-12)
    assert end.velocities[0] == pytest.approx(request.goal.velocities, abs=1e-10)
    for waypoint in request.waypoints:
        there = made.sample(np.array([waypoint.time_from_start]))
        assert there.positions[0] == pytest.approx(waypoint.positions, abs=1e-9)
    w = optimum_without_limits(program_of(figure, request))
    s = np.linspace(0, 1 - 1e-9, 7919)
    psi = np.exp(-(((s[:, None] - np.linspace(0, 1, 50)) * 49 / 0.7) ** 2) / 2)
    expected = psi @ w / request.moving_duration**2
    found = made.sample(s * request.moving_duration).accelerations[:, 0]
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


def test_a_motion_along_its_jerk_limit_needs_the_safety_margin(
    figure: Primitive, ask: Ask, paper_limits: Limits
) -> None:
    """Without it the jerk exceeds its limit between samples; the margin raises the imitation error by less than 1 %."""
    tight = replace(paper_limits, jerks=np.array([2500.0]))
    request = ask(waypoints=(Waypoint(0.5, np.array([1.0]), np.array([-3.0])),), limits=tight, tail="coast")
    bare, inside = (plan_gaussian(figure, request, margin=margin) for margin in (0.0, SAFETY_MARGIN))
    check_limits(inside)
    assert inside.report.imitation_rms[0] >= bare.report.imitation_rms[0] > 0.99 * inside.report.imitation_rms[0]
    with pytest.raises(LimitExceeded):
        check_limits(bare)


def test_the_margin_does_not_refuse_a_goal_on_its_limit(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    made = plan_gaussian(figure, ask(goal=(1.0, 15.0), limits=paper_limits, tail="coast"), margin=SAFETY_MARGIN)
    assert made.report.final_error_velocities[0] < 1e-10
    assert made.report.extremes["velocity"][0, 1] == pytest.approx(15.0, abs=1e-4)


def test_the_report_agrees_with_the_samples(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    made = plan_gaussian(figure, ask(goal=(-1.0, 10.0), limits=paper_limits))
    report, samples = made.report, made.sample(np.linspace(0, made.total_duration, 20001))
    for name, values in (("position", samples.positions), ("acceleration", samples.accelerations)):
        assert report.extremes[name][0] == pytest.approx([values.min(), values.max()], rel=1e-4)
    assert not report.certified
    assert report.basis_count == 50
    assert report.by_limits.max[0] > 0.5
    assert made.samples().velocities[-1, 0] == 0
    free = plan_gaussian(figure, ask(goal=(-1.0, 10.0))).report
    assert free.by_limits.max[0] == 0


def test_imitation_error_agrees_with_the_spline_formulation(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    """Limits and goal determine the error here, not the basis."""
    request = ask(goal=(-1.0, 10.0), limits=paper_limits)
    ratio = plan(figure, request).report.imitation_rms / plan_gaussian(figure, request).report.imitation_rms
    assert ratio[0] == pytest.approx(1.0, abs=0.02)


def test_limits_that_cannot_hold_are_refused(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    with pytest.raises(Infeasible, match="method 'qp' names one that works") as refusal:
        plan_gaussian(figure, ask(start=(0.0, 0.0, 0.0), duration=0.1, limits=paper_limits))
    assert refusal.value.min_duration is None
    assert 0 <= refusal.value.time <= 0.1
    with pytest.raises(LimitExceeded):
        plan_gaussian(figure, ask(goal=(2.1, 0.0), limits=paper_limits))
    with pytest.raises(LimitExceeded, match="joint 0"):
        plan_gaussian(figure, ask(start=(2.015, 0.0), limits=paper_limits))
    with pytest.raises(CannotStop):
        plan_gaussian(figure, ask(goal=(1.9, 12.0), limits=paper_limits))


def test_unsupported_requests_are_refused(figure: Primitive, ask: Ask) -> None:
    with pytest.raises(InvalidMotion, match="place_time"):
        plan_gaussian(figure, ask(place_time=0.5))
    many = tuple(Waypoint((k + 1) / 52, np.zeros(1), FREE) for k in range(51))
    with pytest.raises(InvalidMotion, match="at most 50"):
        plan_gaussian(figure, ask(waypoints=many))
    ends = Boundary(np.zeros(2), np.zeros(2), np.full(2, np.nan))
    with pytest.raises(InvalidMotion, match="primitive"):
        plan_gaussian(figure, MotionRequest(ends, ends, 1.0, Limits.unlimited(2)))
