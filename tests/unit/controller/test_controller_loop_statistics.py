"""What counts as answered in time."""

import pytest

from services.controller.loop_statistics import WINDOW, CycleStatistics


def test_every_tick_in_time():
    """Each state tells that the answer to the one before was applied."""
    cycle = CycleStatistics()
    cycle.begin(0)
    for tick in range(1, 11):
        cycle.note_state(tick, tick - 1)
    said = cycle.message()
    assert (said.count, said.missed, said.on_time_ratio) == (11, 0, 1.0)


def test_answers_that_came_too_late():
    """An older command was applied, for two of four ticks."""
    cycle = CycleStatistics()
    cycle.begin(0)
    for tick, applied in ((1, 0), (2, 0), (3, 1), (4, 3)):
        cycle.note_state(tick, applied)
    said = cycle.message()
    assert (said.missed, said.on_time_ratio) == (2, 0.5)


def test_states_that_never_came():
    """Three lost states are three missed ticks; where the last one seen was not answered in time either, four."""
    for applied, missed in ((1, 3), (0, 4)):
        cycle = CycleStatistics()
        cycle.begin(0)
        cycle.note_state(1, 0)
        cycle.note_state(5, applied)
        cycle.note_state(6, 5)
        said = cycle.message()
        assert (said.count, said.missed) == (4, missed)
        assert said.on_time_ratio == pytest.approx(1 - missed / 6)


def test_a_new_run_counts_anew():
    """A controller that joins late is not to blame for the ticks before."""
    cycle = CycleStatistics()
    cycle.begin(0)
    cycle.note_state(100, 0)
    cycle.begin(5000)
    cycle.note_state(5001, 5000)
    assert (cycle.message().count, cycle.message().missed, cycle.message().on_time_ratio) == (2, 0, 1.0)


def test_response_times():
    """Percentiles of the last thousand, in µs; zeros before the first."""
    cycle = CycleStatistics()
    assert cycle.message().late_us.max == 0.0
    cycle.begin(0)
    for tick in range(1, 2 * WINDOW + 1):
        cycle.note_response(9_000_000 if tick < WINDOW // 2 else tick * 1000)
        cycle.note_state(tick, tick - 1)
    late = cycle.message().late_us
    assert late.max == 2 * WINDOW
    assert late.p50 == pytest.approx(1.5 * WINDOW, abs=2)
    assert late.p99 == pytest.approx(1.99 * WINDOW, abs=2)
