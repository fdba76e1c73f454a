"""Participants of a bus with the permission table: owners, askers, listeners."""

from collections.abc import Callable
from contextlib import ExitStack
from queue import SimpleQueue
from typing import Any

import zenoh
from cell import SecureCell
from harness import PATIENCE_S

from deploy.zenoh.permissions import ROLES, acting, reading
from protocol import topics
from protocol.bus.bus import Bus

BY_NAME = {role.name: role for role in ROLES}


def may(who: str, message: str, key: str) -> bool:
    """Return whether the table lets `who` send `message` on `key`; a stranger may send nothing."""
    if who not in BY_NAME:
        return False
    granted = [p.keys for p in (*reading(), *acting(BY_NAME[who])) if message in p.messages]
    return any(zenoh.KeyExpr(k).includes(zenoh.KeyExpr(key)) for keys in granted for k in keys)


class Participants:
    """Sessions on one bus: those of the owners, who answer b"owner" to all their requests, and others on demand."""

    def __init__(self, cell: SecureCell, stack: ExitStack) -> None:
        self._cell = cell
        self._stack = stack
        self._joined: dict[tuple[str, str], Bus] = {}
        self.arrived: SimpleQueue[tuple[str, bytes]] = SimpleQueue()
        self.heard: SimpleQueue[tuple[str, bytes]] = SimpleQueue()
        self._declared: list[Any] = []
        for topic in topics.QUERIES:
            key = self.owner(topic).key(topic.key)
            self._declared.append(self.owner(topic).session.declare_queryable(key, self._answer, complete=True))
        for topic in topics.PUBLICATIONS:
            ear = self.bus("viewer", "ear")
            self._declared.append(ear.session.declare_subscriber(ear.key(topic.key), self._hear))
        fence(self.bus("viewer", "ear"))

    def bus(self, who: str, purpose: str) -> Bus:
        """Return the session of `who` for a purpose; messages between two sessions pass the router."""
        if (who, purpose) not in self._joined:
            self._joined[who, purpose] = self._stack.enter_context(self._cell.join(who))
        return self._joined[who, purpose]

    def owner(self, topic: topics.Query | topics.Publication) -> Bus:
        """Return the session that owns `topic`."""
        return self.bus(topic.owner, "owner")

    def asker(self, topic: topics.Query) -> Bus:
        """Return a session that may send requests of `topic`."""
        return self.bus(next(role for role in ("planner", "tester") if may(role, "query", topic.key)), "ask")

    def publish(self, topic: topics.Publication, body: bytes) -> None:
        """Publish as the owner; return once the router has sent the message to every subscriber."""
        owner = self.owner(topic)
        owner.session.put(owner.key(topic.key), body)
        assert up_to(self.heard, (owner.key(topic.key), body)) == []
        fence(owner)  # one subscriber may have received it before the router has sent it to all

    def _answer(self, query: zenoh.Query) -> None:
        self.arrived.put((str(query.key_expr), query.payload.to_bytes() if query.payload else b""))
        with query:
            query.reply(query.key_expr, b"owner")

    def _hear(self, sample: zenoh.Sample) -> None:
        body = b"deleted" if sample.kind == zenoh.SampleKind.DELETE else sample.payload.to_bytes()
        self.heard.put((str(sample.key_expr), body))


def fence(bus: Bus) -> None:
    """Return once the router has handled everything that `bus` sent before."""
    for topic in (
        topics.STATUS_QUERY,
        topics.DESCRIPTION,
    ):  # the sender may be the owner of one; the other one passes the router
        list(bus.session.get(bus.key(topic.key), payload=b"fence", timeout=PATIENCE_S))


def at_once(callback: Callable[[zenoh.Sample], object]) -> zenoh.handlers.Callback:
    """Run `callback` in Zenoh's own thread: when a fence is answered, the callback has run."""
    return zenoh.handlers.Callback(callback, indirect=False)


def replies(bus: Bus, key: str, body: bytes) -> list[bytes]:
    """Send a request to everybody who answers on `key` and return their replies, sorted."""
    answers = bus.session.get(
        key,
        payload=body,
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
        timeout=PATIENCE_S,
    )
    return sorted(reply.ok.payload.to_bytes() for reply in answers if reply.ok is not None)


def up_to(queue: SimpleQueue[tuple[str, bytes]], last: tuple[str, bytes]) -> list[tuple[str, bytes]]:
    """Return what is in the queue before `last`, which must arrive; fences are left out."""
    taken = []
    while (item := queue.get(timeout=PATIENCE_S)) != last:
        if item[1] != b"fence":
            taken.append(item)
    return taken
