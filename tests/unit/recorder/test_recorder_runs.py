"""Runs are placed one after another in the trace."""

from services.recorder.runs import Runs


def test_the_first_run_keeps_its_ticks() -> None:
    runs = Runs(1000.0)
    assert [runs.add_state(7, tick) for tick in (3, 4, 5)] == [3, 4, 5]
    assert runs.tick_at(0.004) == 4
    assert (runs.count, runs.present.run, runs.offset) == (1, 7, 0)


def test_the_next_run_follows_the_last_tick_of_the_first() -> None:
    runs = Runs(1000.0)
    for tick in range(10):
        runs.add_state(7, tick)
    assert [runs.add_state(8, tick) for tick in (0, 1)] == [10, 11]
    assert runs.tick_at(0.001) == 11
    assert runs.tick_ahead(5.0) == 5010
    assert (runs.count, runs.present.run, runs.offset) == (2, 8, 10)
    assert runs.newest == 11


def test_a_tick_that_goes_back_starts_another_run_with_the_same_number() -> None:
    runs = Runs(1000.0)
    assert [runs.add_state(0, tick) for tick in (0, 1, 2, 0, 1)] == [0, 1, 2, 3, 4]
    assert runs.count == 2


def test_a_tick_that_is_published_again_begins_no_run() -> None:
    """An arm that is guided publishes its tick again, also tick 0; an arm that was reset is ready."""
    runs = Runs(1000.0)
    assert [runs.add_state(0, 0), runs.add_state(0, 0, ready=False), runs.add_state(0, 1)] == [0, 0, 1]
    assert [runs.add_state(0, 1, ready=False), runs.add_state(0, 2)] == [1, 2]
    assert (runs.count, runs.missing_states) == (1, 0)
    assert [runs.add_state(0, 0), runs.add_state(0, 0)] == [3, 4]
    assert runs.count == 3


def test_a_late_command_is_placed_in_its_own_run() -> None:
    runs = Runs(1000.0)
    for tick in range(5):
        runs.add_state(7, tick)
    runs.add_state(8, 0)
    assert runs.add_command(7, 4) == 4
    assert runs.add_command(8, 0) == 5


def test_a_command_before_any_state_starts_the_run() -> None:
    runs = Runs(1000.0)
    assert runs.add_command(7, 12) == 12
    assert runs.add_state(7, 12) == 12
    assert runs.count == 1


def test_a_late_event_of_the_previous_run_is_placed_there() -> None:
    runs = Runs(1000.0)
    for tick in range(5000):
        runs.add_state(7, tick)
    runs.add_state(8, 0)
    assert runs.tick_at(4.5) == 4500
    assert runs.tick_at(0.0) == 5000


def test_gaps_are_counted_within_a_run_but_not_before_its_first_tick() -> None:
    runs = Runs(1000.0)
    for tick in (100, 101, 104):
        runs.add_state(7, tick)
        runs.add_command(7, tick)
    runs.add_state(8, 50)
    runs.add_command(8, 50)
    assert (runs.missing_states, runs.missing_commands) == (2, 2)
