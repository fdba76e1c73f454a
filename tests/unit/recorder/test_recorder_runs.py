"""Runs laid one behind the other."""

from services.recorder.runs import Lives, Run


def _lives() -> tuple[Lives, list[Run]]:
    begun: list[Run] = []
    return Lives(1000.0, begun.append), begun


def test_first_run_lies_where_it_says() -> None:
    lives, begun = _lives()
    assert [lives.lay_state(7, tick) for tick in (3, 4, 5)] == [3, 4, 5]
    assert lives.lay_time(0.004) == 4
    assert [(life.run, life.offset) for life in begun] == [(7, 0)]


def test_next_run_lies_behind() -> None:
    lives, begun = _lives()
    for tick in range(10):
        lives.lay_state(7, tick)
    assert [lives.lay_state(8, tick) for tick in (0, 1)] == [10, 11]
    assert lives.lay_time(0.001) == 11
    assert lives.lay_ahead(5.0) == 5010
    assert [(life.run, life.offset) for life in begun] == [(7, 0), (8, 10)]
    assert lives.newest == 11


def test_tick_that_goes_back_begins_a_run_of_the_same_name() -> None:
    lives, begun = _lives()
    laid = [lives.lay_state(0, tick) for tick in (0, 1, 2, 0, 1)]
    assert laid == [0, 1, 2, 3, 4]
    assert len(begun) == 2


def test_late_command_lies_in_its_own_run() -> None:
    lives, _ = _lives()
    for tick in range(5):
        lives.lay_state(7, tick)
    lives.lay_state(8, 0)
    assert lives.lay_command(7, 4) == 4
    assert lives.lay_command(8, 0) == 5


def test_command_before_any_state_begins_the_run() -> None:
    lives, begun = _lives()
    assert lives.lay_command(7, 12) == 12
    assert lives.lay_state(7, 12) == 12
    assert len(begun) == 1


def test_late_news_of_the_run_before_lies_there() -> None:
    lives, _ = _lives()
    for tick in range(5000):
        lives.lay_state(7, tick)
    lives.lay_state(8, 0)
    assert lives.lay_time(4.5) == 4500
    assert lives.lay_time(0.0) == 5000


def test_gaps_are_counted_and_beginnings_are_not() -> None:
    lives, _ = _lives()
    for tick in (100, 101, 104):
        lives.lay_state(7, tick)
        lives.lay_command(7, tick)
    lives.lay_state(8, 50)
    lives.lay_command(8, 50)
    assert (lives.missing_states, lives.missing_commands) == (2, 2)
