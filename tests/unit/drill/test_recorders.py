"""What the drill finds missing in a trace."""

from tools.drill.scenarios.recorders import missing_inside


def test_ticks_missing_inside():
    """Between the first and the last, in whatever order they were written, each once."""
    assert missing_inside([]) == 0
    assert missing_inside([7]) == 0
    assert missing_inside([9, 7, 8]) == 0
    assert missing_inside([3, 4, 4, 8, 10]) == 4
