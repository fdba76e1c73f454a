"""Leases of clients: a client needs its liveliness token for a lease, and loses the lease with the token."""

import logging
import threading

from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.queues import Inbox
from services.common.logs import ThrottledLog
from services.controller.core import Controller

MAX_EVENTS = 256
"""Capacity of the queue of liveliness events. The loop handles one a tick, so only a flood overflows it."""


class ClientLeases:
    """Tracks which clients hold their tokens, and ends the lease of a client that loses its token.

    Attributes:
        clients: The clients that hold their tokens.
    """

    def __init__(self, core: Controller, log: logging.Logger) -> None:
        self.clients: set[str] = set()
        self._core = core
        self._floods = ThrottledLog(log)
        self._events: Inbox[tuple[str, bool]] = Inbox(MAX_EVENTS)
        self._overflowed = threading.Event()

    def open(self, bus: Bus) -> None:
        """Subscribe to the tokens of all clients."""
        bus.watch_alive(topics.alive_key("client/*"), self._receive)

    def step(self) -> None:
        """Apply the next event; if any was dropped, end every lease, because the holder may have left."""
        if self._overflowed.is_set():
            self._overflowed.clear()
            while self._events.take() is not None:
                pass
            self._floods.warn(f"more than {MAX_EVENTS} liveliness events at once: every lease counts as lost")
            while self.clients:
                self._core.end_lease(self.clients.pop())
        event = self._events.take()
        if event is None:
            return
        client_id, alive = event
        if alive:
            self.clients.add(client_id)
        else:
            self.clients.discard(client_id)
            self._core.end_lease(client_id)

    def _receive(self, key: str, alive: bool) -> None:
        if not self._events.offer((key.rpartition("/")[2], alive)):
            self._overflowed.set()
