"""The silence watchdog: counts the ticks without a state of the arm."""

from collections.abc import Callable

FIRST_WAIT = 1.2
"""Length of the first wait after a state, ticks: above 1, so that the next state ends it before it expires."""
WAIT = 0.96
"""Length of each later wait, ticks: below 1, so that 20 waits end within 20 ticks after a state, even a late one."""
STALL_NS = 5_000_000
"""Largest part of a loop's stall that counts as silence: a dying sim blocks the shared core for 2 to 4 ms."""


class SilenceWatchdog:
    """Divides the time after a state into waits of about a tick, and counts those that end without another state.

    A stall of this process counts at most `STALL_NS`, because a stalled machine also stalls the arm.
    """

    def __init__(self, tick: float, clock: Callable[[], int]) -> None:
        """Start with a wait that has already ended.

        Args:
            tick: s.
            clock: Returns monotonic time, ns.
        """
        self.silent_waits = 0
        self._clock = clock
        self._first_wait_ns, self._wait_ns = (round(ticks * tick * 1e9) for ticks in (FIRST_WAIT, WAIT))
        self._wait_ends_ns = 0

    @property
    def time_left(self) -> float:
        """Time until the present wait ends, s; 0 if it has ended."""
        return max(0, self._wait_ends_ns - self._clock()) * 1e-9

    def feed(self, received_ns: int) -> None:
        """Start over: a valid state was received at `received_ns` of the clock."""
        self.silent_waits, self._wait_ends_ns = 0, received_ns + self._first_wait_ns

    def end_wait(self) -> bool:
        """If the present wait has ended, count it, start the next one and return True."""
        now_ns = self._clock()
        if now_ns < self._wait_ends_ns:
            return False
        self._wait_ends_ns = max(self._wait_ends_ns + self._wait_ns, now_ns - STALL_NS)
        self.silent_waits += 1
        return True
