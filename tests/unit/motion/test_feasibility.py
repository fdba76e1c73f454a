"""Feasibility checks of one motion in several durations."""

import numpy as np
import pytest

from motion.limits import Limits
from motion.plan import plan_fastest
from motion.primitive import Primitive
from motion.program import constraint_generation
from motion.program.effort import Effort
from motion.program.feasibility import FeasibilityCheck
from motion.program.terminal_set import final_accelerations
from tests.unit.motion.asking import Ask


def test_a_contradiction_refutes_other_durations_without_a_program(
    figure: Primitive, ask: Ask, paper_limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It refutes shorter ones, and never a feasible one."""
    request = ask(start=(0.0, 0.0, 0.0), limits=paper_limits)
    shortest = plan_fastest(figure, request).duration
    check = FeasibilityCheck(figure, final_accelerations(request), Effort(1e5))
    assert not check.passes(request.stretched(0.97 * shortest), 1e4)
    assert check.contradictions[0].rows.size
    with monkeypatch.context() as without:
        without.setattr(constraint_generation, "least_distance", None)
        assert not check.passes(request.stretched(0.96 * shortest), 1e4)
    for factor in (1.0, 1.05, 1.5, 3.0):
        assert check.passes(request.stretched(factor * shortest), 1e4)


def test_a_check_begins_with_the_rows_of_the_last_feasible_duration(
    figure: Primitive, ask: Ask, paper_limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same duration again takes one program."""
    request = ask(start=(0.0, 0.0, 0.0), limits=paper_limits)
    request = request.stretched(1.02 * plan_fastest(figure, request).duration)
    check = FeasibilityCheck(figure, final_accelerations(request), Effort(1e5))
    solved, counts = constraint_generation.least_distance, []

    def counted(*program: np.ndarray, tight: bool) -> tuple[np.ndarray, str]:
        counts.append(len(program[1]))
        return solved(*program, tight=tight)

    monkeypatch.setattr(constraint_generation, "least_distance", counted)
    assert check.passes(request, 1e4)
    assert len(counts) > 3
    counts.clear()
    assert check.passes(request, 1e4)
    assert len(counts) <= 2
