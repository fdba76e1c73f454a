"""Plans keep the places of the demonstration: under limits, with a place time, and from a phase on."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BSpline

from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest
from tests.unit.motion.asking import Ask


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
