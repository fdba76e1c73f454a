"""The arm's newest tick at a wall-clock time."""

from services.recorder.runs import StateTimes


def test_tick_at_a_wall_time_is_the_newest_state_received() -> None:
    state_times = StateTimes()
    assert (state_times.tick_at(5), state_times.oldest) == (0, None)
    state_times.add_batch([100, 110, 120], [7, 8, 9])
    assert [state_times.tick_at(wall) for wall in (99, 100, 115, 120, 999)] == [7, 7, 8, 9, 9]


def test_the_last_two_batches_are_kept() -> None:
    state_times = StateTimes()
    for first in (0, 10, 20):
        state_times.add_batch([100 + first, 105 + first], [first, first + 5])
    assert state_times.oldest == 10
    assert state_times.tick_at(112) == 10
