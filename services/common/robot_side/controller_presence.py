"""Whether a controller answers states, so that the paced and the stepped clock wait for it."""

import time
from collections.abc import Callable

HANG_S = 2.0
"""A controller that takes longer to answer a tick is no longer waited for."""


class ControllerPresence:
    """Whether there is a controller to wait for: its liveliness token is there, and it does not hang.

    A controller hangs from its first overdue answer until its next command. `wake` is called, in Zenoh's thread, when
    the token appears or is lost.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._alive = False
        self._hangs = False
        self._since = time.monotonic()

    def see(self, _: str, alive: bool) -> None:
        """Note that the token is there, or is lost."""
        self._alive, self._since = alive, time.monotonic()
        self._wake()

    def note_state(self) -> None:
        """Note that a state was published, which the controller has yet to answer."""
        self._since = time.monotonic()

    def note_command(self) -> None:
        """Note a command."""
        self._hangs = False

    def starts_to_hang(self) -> bool:
        """Return True once, where the answer is overdue by now."""
        begins = self.is_awaited and time.monotonic() > self._since + HANG_S
        self._hangs |= begins
        return begins

    @property
    def is_awaited(self) -> bool:
        """Whether time must stand still until the controller has answered."""
        return self._alive and not self._hangs
