"""The tick of the arm at a wall time."""

from services.recorder.arrivals import Arrivals


def test_the_newest_tick_at_a_wall_time() -> None:
    arrivals = Arrivals()
    assert (arrivals.tick_at(5), arrivals.oldest) == (0, None)
    arrivals.add_batch([100, 110, 120], [7, 8, 9])
    assert [arrivals.tick_at(wall) for wall in (99, 100, 115, 120, 999)] == [7, 7, 8, 9, 9]


def test_two_batches_are_known() -> None:
    arrivals = Arrivals()
    for first in (0, 10, 20):
        arrivals.add_batch([100 + first, 105 + first], [first, first + 5])
    assert arrivals.oldest == 10
    assert arrivals.tick_at(112) == 10
