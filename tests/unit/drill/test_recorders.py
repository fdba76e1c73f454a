"""Ticks that the drill finds missing in a trace."""

from tools.drill.scenarios.recorders import missing_inside


def test_ticks_missing_inside():
    """Missing ticks between the first and the last are counted once, in whatever order ticks were written."""
    assert missing_inside([]) == 0
    assert missing_inside([7]) == 0
    assert missing_inside([9, 7, 8]) == 0
    assert missing_inside([3, 4, 4, 8, 10]) == 4
