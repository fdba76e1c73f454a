"""Statistics of answers in time."""

import pytest

from services.controller.loop_statistics import WINDOW, LoopStatistics


def test_answers_applied_at_the_next_tick_are_in_time():
    """By each state the answer to the one before was applied."""
    statistics = LoopStatistics()
    statistics.begin(0)
    for tick in range(1, 11):
        statistics.note_state(tick, tick - 1)
    sent = statistics.message()
    assert (sent.count, sent.missed, sent.on_time_ratio) == (11, 0, 1.0)


def test_answers_applied_later_are_missed_ticks():
    """An older command was applied, for two of four ticks."""
    statistics = LoopStatistics()
    statistics.begin(0)
    for tick, applied in ((1, 0), (2, 0), (3, 1), (4, 3)):
        statistics.note_state(tick, applied)
    sent = statistics.message()
    assert (sent.missed, sent.on_time_ratio) == (2, 0.5)


def test_lost_states_are_missed_ticks():
    """Three lost states are three missed ticks; where the last one seen was not answered in time either, four."""
    for applied, missed in ((1, 3), (0, 4)):
        statistics = LoopStatistics()
        statistics.begin(0)
        statistics.note_state(1, 0)
        statistics.note_state(5, applied)
        statistics.note_state(6, 5)
        sent = statistics.message()
        assert (sent.count, sent.missed) == (4, missed)
        assert sent.on_time_ratio == pytest.approx(1 - missed / 6)


def test_a_new_run_restarts_the_count():
    """A controller that joins late does not count the ticks before."""
    statistics = LoopStatistics()
    statistics.begin(0)
    statistics.note_state(100, 0)
    statistics.begin(5000)
    statistics.note_state(5001, 5000)
    assert (statistics.message().count, statistics.message().missed, statistics.message().on_time_ratio) == (2, 0, 1.0)


def test_percentiles_of_response_times():
    """Percentiles of the last thousand, in µs; zeros before the first."""
    statistics = LoopStatistics()
    assert statistics.message().late_us.max == 0.0
    statistics.begin(0)
    for tick in range(1, 2 * WINDOW + 1):
        statistics.note_response(9_000_000 if tick < WINDOW // 2 else tick * 1000)
        statistics.note_state(tick, tick - 1)
    late = statistics.message().late_us
    assert late.max == 2 * WINDOW
    assert late.p50 == pytest.approx(1.5 * WINDOW, abs=2)
    assert late.p99 == pytest.approx(1.99 * WINDOW, abs=2)
