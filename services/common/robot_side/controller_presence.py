"""Detect whether a controller answers states, so that the paced and the stepped clock wait for it."""

import time
from collections.abc import Callable

HANG_S = 2.0
"""Timeout of the controller's answer to a tick."""


class ControllerPresence:
    """Detects a controller that holds its liveliness token and does not hang.

    A controller hangs from its first overdue answer until its next command. `wake` is called, in Zenoh's thread, when
    the token appears or is lost.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._alive = False
        self._hangs = False
        self._since = time.monotonic()

    def see(self, _: str, alive: bool) -> None:
        """Store whether the token exists."""
        self._alive, self._since = alive, time.monotonic()
        self._wake()

    def note_state(self) -> None:
        """Start the timeout of the answer to a published state."""
        self._since = time.monotonic()

    def note_command(self) -> None:
        """End the timeout: a command has arrived."""
        self._hangs = False

    def starts_to_hang(self) -> bool:
        """Return True once if the answer is overdue."""
        begins = self.is_awaited and time.monotonic() > self._since + HANG_S
        self._hangs |= begins
        return begins

    @property
    def is_awaited(self) -> bool:
        """Whether time must wait for the controller's answer."""
        return self._alive and not self._hangs
