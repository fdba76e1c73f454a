"""Waiting for a condition whose check takes longer than the timeout."""

import time
from collections.abc import Callable

import pytest

from tools.drill.harness.waiting import ScenarioError, eventually, wait_for

PATIENCE_S = 0.05


def slow(*answers: bool) -> Callable[[], bool]:
    """Return a condition that takes longer than the timeout and gives these answers."""
    left = iter(answers)

    def check() -> bool:
        time.sleep(2 * PATIENCE_S)
        return next(left)

    return check


def test_a_condition_is_checked_once_more_after_the_timeout():
    assert eventually(slow(False, True), PATIENCE_S)
    assert wait_for(slow(False, True), "it", PATIENCE_S) > 2 * PATIENCE_S


def test_a_condition_that_does_not_hold_ends_the_wait():
    assert not eventually(slow(False, False), PATIENCE_S)
    with pytest.raises(ScenarioError, match=r"waited 0\.05 s for it"):
        wait_for(slow(False, False), "it", PATIENCE_S)
