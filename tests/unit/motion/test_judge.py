"""Decisions on several durations of one motion."""

import numpy as np
import pytest

from motion.limits import Limits
from motion.plan import plan_fastest
from motion.primitive import Primitive
from motion.program import constraint_generation
from motion.program.effort import Effort
from motion.program.judge import Judge
from motion.program.min_duration import stretched
from motion.program.terminal_set import final_accelerations
from tests.unit.motion.asking import Ask


def test_a_contradiction_refutes_other_durations_without_a_program(
    figure: Primitive, ask: Ask, paper_limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It refutes shorter ones, and never a feasible one."""
    request = ask(start=(0.0, 0.0, 0.0), limits=paper_limits)
    shortest = plan_fastest(figure, request).duration
    judge = Judge(figure, final_accelerations(request), Effort(1e5))
    assert judge.failing(stretched(request, 0.97 * shortest), [0], 1e4) == 0
    assert judge.contradictions[0].rows.size
    with monkeypatch.context() as without:
        without.setattr(constraint_generation, "least_distance", None)
        assert judge.failing(stretched(request, 0.96 * shortest), [0], 1e4) == 0
    for factor in (1.0, 1.05, 1.5, 3.0):
        assert judge.failing(stretched(request, factor * shortest), [0], 1e4) is None


def test_a_decision_begins_with_the_rows_of_the_last_feasible_duration(
    figure: Primitive, ask: Ask, paper_limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same duration again takes one program."""
    request = ask(start=(0.0, 0.0, 0.0), limits=paper_limits)
    request = stretched(request, 1.02 * plan_fastest(figure, request).duration)
    judge = Judge(figure, final_accelerations(request), Effort(1e5))
    solved, counts = constraint_generation.least_distance, []

    def counted(*program: np.ndarray, tight: bool) -> tuple[np.ndarray, str]:
        counts.append(len(program[1]))
        return solved(*program, tight=tight)

    monkeypatch.setattr(constraint_generation, "least_distance", counted)
    assert judge.failing(request, [0], 1e4) is None
    assert len(counts) > 3
    counts.clear()
    assert judge.failing(request, [0], 1e4) is None
    assert len(counts) <= 2
