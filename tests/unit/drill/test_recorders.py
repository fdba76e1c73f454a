"""Counting missing ticks of a trace."""

from tools.drill.scenarios.recorders import missing_inside


def test_missing_ticks_between_the_first_and_the_last_are_counted():
    """Each is counted once, for any order of ticks."""
    assert missing_inside([]) == 0
    assert missing_inside([7]) == 0
    assert missing_inside([9, 7, 8]) == 0
    assert missing_inside([3, 4, 4, 8, 10]) == 4
