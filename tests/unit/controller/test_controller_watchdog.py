"""How long silence lasts until the watchdog has counted it."""

import pytest

from services.controller.watchdog import SilenceWatchdog
from tests.unit.controller.stand_ins import FakeClock

TICK, TICKS = 1e-3, 20


def silence(tick: float = TICK, stall: float = 0.0) -> float:
    """Return the time from a state to the end of the 20th wait, in ticks.

    The loop is stalled for `stall` s after it.
    """
    clock = FakeClock()
    watchdog = SilenceWatchdog(tick, clock)
    began_ns = clock()
    watchdog.feed(began_ns)
    clock.pass_by(stall)
    while watchdog.silent_waits < TICKS:
        clock.pass_by(watchdog.time_left)
        assert watchdog.end_wait()
    return (clock() - began_ns) * 1e-9 / tick


@pytest.mark.parametrize("stall_ms", [0.0, 0.5, 1.0, 2.5, 4.0, 5.0])
def test_silence_is_counted_within_its_ticks(stall_ms: float):
    """Half a tick is left to report it, even if a dying sim blocks the core."""
    assert TICKS - 1.0 < silence(stall=stall_ms * 1e-3) <= TICKS - 0.5


def test_silence_is_counted_in_the_ticks_of_the_arm():
    assert TICKS - 1.0 < silence(tick=1e-2) <= TICKS


def test_a_stall_of_the_machine_is_not_counted_as_silence():
    """The arm stalled too. Of the stall, only the 5 ms of a dying sim and the wait in which it began count."""
    stall_ms = 100.0
    assert silence(stall=stall_ms * 1e-3) > stall_ms + TICKS - 8.0


def test_the_next_state_ends_the_first_wait():
    """A state that is a tenth of a tick late still arrives within the first wait."""
    clock = FakeClock()
    watchdog = SilenceWatchdog(TICK, clock)
    watchdog.feed(clock())
    clock.pass_by(1.1 * TICK)
    assert watchdog.time_left > 0
    assert not watchdog.end_wait()
    assert watchdog.silent_waits == 0


def test_a_wait_is_counted_once():
    """Waking up during the wait counts nothing; the next state starts again at 0."""
    clock = FakeClock()
    watchdog = SilenceWatchdog(TICK, clock)
    watchdog.feed(clock())
    clock.pass_by(1.3 * TICK)
    assert [watchdog.end_wait() for _ in range(3)] == [True, False, False]
    assert watchdog.silent_waits == 1
    watchdog.feed(clock())
    assert (watchdog.silent_waits, watchdog.time_left) == (0, pytest.approx(1.2 * TICK))


def test_the_first_wait_ends_at_once():
    watchdog = SilenceWatchdog(TICK, FakeClock())
    assert watchdog.time_left == 0
    assert watchdog.end_wait()
