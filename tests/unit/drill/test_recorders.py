"""Counting missing ticks of a trace."""

from tools.drill.scenarios.recorders import missing_between


def test_missing_ticks_between_the_first_and_the_last_are_counted():
    """Each is counted once, for any order of ticks."""
    assert missing_between([]) == 0
    assert missing_between([7]) == 0
    assert missing_between([9, 7, 8]) == 0
    assert missing_between([3, 4, 4, 8, 10]) == 4
