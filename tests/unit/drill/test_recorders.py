"""Ticks that the drill finds missing in a trace."""

from tools.drill.scenarios.recorders import missing_between


def test_ticks_missing_within_a_trace():
    """Missing ticks between the first and the last are counted once, in whatever order ticks were written."""
    assert missing_between([]) == 0
    assert missing_between([7]) == 0
    assert missing_between([9, 7, 8]) == 0
    assert missing_between([3, 4, 4, 8, 10]) == 4
