"""Plans that begin with the active rows of another plan."""

import numpy as np
import pytest

from motion.errors import SolverFailed
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.program import constraint_generation, optimum
from motion.program.contradiction import InfeasibleRows
from motion.request import Waypoint
from tests.unit.motion.asking import FREE, Ask


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
