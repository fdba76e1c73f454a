"""Prescribed values on their limits and beyond them, and solutions that violate a limit."""

from dataclasses import replace

import numpy as np
import pytest

from motion.errors import LimitExceeded, MotionError, SolverFailed
from motion.limits import QUANTITIES, Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.program import constraint_generation, optimum
from motion.program.constraint_generation import Solution
from motion.request import Waypoint
from tests.unit.motion.asking import FREE, Ask

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
