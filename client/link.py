"""A connection to the keys of one robot."""

import threading
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import zenoh

from client.mailboxes import Mailbox
from protocol.bus.bus import Bus
from protocol.errors import NoAnswer
from protocol.topics import Publication, Query, ReplyT, RequestT

ALIVE_S = 1.0
"""Timeout of the liveliness query that explains a missing reply."""

CLOSED = "this connection is closed"


class Link:
    """Sends requests and subscribes over a bus; replies and messages arrive in mailboxes.

    Attributes:
        bus: The bus of the connection.
        mailbox: Makes a mailbox of a given capacity; its kind decides whether the link blocks.
        client_id: Name of the client, empty for an anonymous one.
        timeout: Timeout of replies, s; None: the topic's own.
    """

    def __init__(self, bus: Bus, mailbox: Callable[[int], Mailbox[Any]], client_id: str, timeout: float | None) -> None:
        self.bus = bus
        self.mailbox = mailbox
        self.client_id = client_id
        self.timeout = timeout
        self._lease_lock = threading.Lock()
        self._leases = 0
        self._token: zenoh.LivelinessToken | None = None
        self._streams: set[Callable[[], object]] = set()

    @property
    def leased(self) -> bool:
        """Whether the client holds a lease at present."""
        return self._leases > 0

    @contextmanager
    def lease(self) -> Iterator[str]:
        """Hold the client's liveliness token for a `with` block, and return the client's id, a new one for "".

        Of several blocks at once, the last one withdraws the token.
        """
        with self._lease_lock:
            self.client_id = self.client_id or f"client-{uuid.uuid4().hex[:8]}"
            if not self._leases:
                self._token = self.bus.announce(f"client/{self.client_id}")
            self._leases += 1
        try:
            yield self.client_id
        finally:
            with self._lease_lock:
                self._leases -= 1
                if not self._leases and self._token is not None:
                    self.bus.withdraw(self._token)

    def close(self) -> None:
        """End the streams and leave the bus."""
        for end in list(self._streams):
            end()
        self.bus.close()

    async def ask(self, topic: Query[RequestT, ReplyT], request: RequestT) -> ReplyT:
        """Send `request` and return the reply.

        Raises:
            Refusal: the owner refused.
            NoAnswer: the owner does not exist or does not reply.
        """
        if self.bus.closed:
            raise NoAnswer(topic.owner, self.bus.key(topic.key), CLOSED)
        box: Mailbox[zenoh.Reply | None] = self.mailbox(2)
        self.bus.send_to(topic, request, box.put, self.timeout)
        if (reply := await box.take()) is None:
            raise NoAnswer(topic.owner, self.bus.key(topic.key), await self._reason(topic))
        return self.bus.read(topic, reply)

    def subscribe(self, topic: Publication, put: Callable[[bytes], object]) -> Callable[[], None]:
        """Call `put` with the body of every publication on `topic`, in another thread; return what stops it."""
        return partial(self.bus.withdraw, self.bus.listen(topic, put))

    def stream(self, topic: Publication, box: Mailbox[bytes | None]) -> Callable[[], None]:
        """Put the body of every publication on `topic` into `box`, then None; return a function that stops it."""
        undeclare = self.subscribe(topic, box.put)

        def end() -> None:
            try:
                self._streams.remove(end)
            except KeyError:  # ended already, perhaps by another thread
                return
            undeclare()
            box.put(None)

        self._streams.add(end)
        return end

    async def _reason(self, topic: Query) -> str:
        """Return a sentence with the likely cause of a request that ended before its timeout, without a reply."""
        if self.bus.closed:
            return CLOSED
        alive = await self.alive()
        services = sorted(service for robot, service in alive if robot == self.bus.robot)
        if topic.owner in services:
            return f"the {topic.owner} runs, but sent no reply"
        if services:
            return f"the {topic.owner} is not running; these services run: {', '.join(services)}"
        if others := sorted({robot for robot, _ in alive}):
            return unknown_robot(self.bus.robot, others)
        return f"the {topic.owner} is not running, or not on this bus; start the robot with: volley up"

    async def alive(self) -> set[tuple[str, str]]:
        """Return (robot, service) for every ready service on the bus; empty if the router does not reply."""
        box: Mailbox[zenoh.Reply | None] = self.mailbox(256)
        # In a thread of its own: Zenoh holds a lock of the session while it calls and drops a handler of this query.
        handler = zenoh.handlers.Callback(box.put, drop=lambda: box.put(None), indirect=True)
        self.bus.session.liveliness().get("volley/*/alive/*", handler, timeout=ALIVE_S)
        found = set()
        while (reply := await box.take()) is not None:
            if reply.ok is not None:
                _, robot, _, service = str(reply.ok.key_expr).split("/")
                found.add((robot, service))
        return found


def unknown_robot(name: str, others: Sequence[str]) -> str:
    """Return a sentence that lists the robots on the bus."""
    return f"no robot has the name {name!r} on this bus; choose from {', '.join(map(repr, others))}"
