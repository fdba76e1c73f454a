"""Bounded effort: what would take too long is planned with fewer functions, or refused."""

from dataclasses import replace

import numpy as np
import pytest

from motion import plan as plan_module
from motion.errors import Infeasible, OutOfTime, SolverFailed
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest, Waypoint
from tests.splines_of import fitted
from tests.unit.motion.asking import Ask


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
