"""The topics of one robot on a Zenoh session: publish, subscribe, answer and send requests, watch liveliness."""

import contextlib
import threading
import time
from collections.abc import Callable
from typing import Generic, Self, TypeVar

import zenoh

from protocol import messages as m
from protocol.bus.links import guard_links
from protocol.bus.pending_query import PendingQuery
from protocol.bus.queues import Collector, Inbox, Stream
from protocol.bus.sessions import CLIENT
from protocol.codec import ENCODING, bad_message, decode, encode
from protocol.errors import NoAnswer, Refusal
from protocol.topics import (
    PUBLICATIONS,
    QUEUE_LENGTH,
    MessageT,
    Publication,
    Query,
    ReplyT,
    RequestT,
    alive_key,
    claim_key,
)

Item = TypeVar("Item")

PUBLISHED = frozenset(topic.key for topic in PUBLICATIONS)
LIVELINESS_S = 5.0
"""Timeout of a liveliness query, which the router answers at once unless it is stalled."""
CLAIM_TIMEOUT_S, CLAIM_PERIOD_S = 2.0, 0.05
"""How long a claim waits for another session to withdraw, and how often it checks."""


class Publisher(Generic[MessageT]):
    """Publishes the messages of one topic."""

    def __init__(self, publisher: zenoh.Publisher) -> None:
        self._publisher = publisher

    def put(self, message: MessageT) -> None:
        """Publish `message`; a session that is closing drops it."""
        self._publisher.put(encode(message))


class Bus:
    """The keys of one robot on one session.

    closed: whether the session was closed. Zenoh's own `is_closed` waits for a lock and keeps Python's interpreter
    lock meanwhile, so it can wait for ever.
    """

    def __init__(self, session: zenoh.Session, robot: str = "arm") -> None:
        self.session = session
        self.robot = robot
        self.closed = False
        self._kept: list[object] = []
        self._puts: dict[str, Collector] = {}
        self._keep(guard_links(session, CLIENT.lease_ms))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the session, and with it everything that was declared."""
        self.closed = True
        self.session.close()

    def key(self, name: str) -> str:
        """Return the full key of a topic's `name`."""
        return f"volley/{self.robot}/{name}"

    def publisher(self, topic: Publication[MessageT], blocking: bool = False) -> Publisher[MessageT]:
        """Declare a publisher; it drops samples that cannot be sent at once or, if `blocking`, waits.

        The router forwards blocking samples as blocking: one subscriber with a dead link delays all samples of the
        publisher, to every subscriber, for seconds.
        """
        return Publisher(
            self.session.declare_publisher(
                self.key(topic.key),
                encoding=ENCODING,
                priority=zenoh.Priority.REAL_TIME if topic.stream else zenoh.Priority.DATA,
                congestion_control=zenoh.CongestionControl.BLOCK if blocking else zenoh.CongestionControl.DROP,
                express=topic.stream,
            )
        )

    def listen(self, topic: Publication, callback: Callable[[bytes], object]) -> zenoh.Subscriber[None]:
        """Pass the body of every sample to `callback`, in a separate thread; the callback must queue it and return.

        Zenoh's receiving thread must not wait for Python: a slow callback would block the publishers, and 1 kHz streams
        beside a flood of goals would silence the arm.
        """
        return self._keep(
            self.session.declare_subscriber(self.key(topic.key), lambda sample: callback(sample.payload.to_bytes()))
        )

    def stream(self, topic: Publication, stream: Stream) -> None:
        """Queue the samples of a topic in `stream`, for a loop that answers each sample."""
        self._keep(self.session.declare_subscriber(self.key(topic.key), stream.callback))

    def collect(self, topic: Publication, length: int) -> Collector:
        """Keep the newest `length` samples of a topic, for reading in batches; the publisher never waits."""
        channel = zenoh.handlers.RingChannel(length)
        return Collector(self._keep(self.session.declare_subscriber(self.key(topic.key), channel)))

    def serve(self, topic: Query[RequestT, ReplyT], inbox: Inbox[PendingQuery]) -> None:
        """Queue requests on `topic` in `inbox`.

        Wildcards in a request that writes are refused as `bad_message`, requests to a full inbox as `busy`.
        """
        key = self.key(topic.key)

        def receive(query: zenoh.Query) -> None:
            pending = PendingQuery(topic, key, query)
            if not topic.reads and "*" in str(query.key_expr):
                pending.refuse(bad_message("key", f"{query.key_expr} has a wildcard; send this request to {key}"))
            elif not inbox.offer(pending):
                sentence = f"{topic.owner} has {QUEUE_LENGTH} requests waiting; send this one again later"
                pending.refuse(Refusal("busy", sentence, goal_id=None))

        self._keep(self.session.declare_queryable(key, receive, complete=True))
        if topic.key not in PUBLISHED:
            channel = zenoh.handlers.RingChannel(1)  # runs no Python, however many samples arrive
            self._puts[key] = Collector(self._keep(self.session.declare_subscriber(key, channel)))

    def take_puts(self) -> list[str]:
        """Return the keys of the served topics to which a client has put, instead of queried, since the last call."""
        return [key for key, puts in self._puts.items() if puts.drop()]

    def ask_later(self, topic: Query[RequestT, ReplyT], request: RequestT, callback: Callable[[bytes], object]) -> None:
        """Send `request` and return at once; the body of a reply goes to `callback`, in Zenoh's thread."""

        def receive(reply: zenoh.Reply | None) -> None:
            if reply is not None and reply.ok is not None:
                callback(reply.ok.payload.to_bytes())

        self.send_to(topic, request, receive)

    def ask(self, topic: Query[RequestT, ReplyT], request: RequestT, timeout: float | None = None) -> ReplyT:
        """Send `request` and return the reply, waiting up to `timeout` s (the topic's own by default).

        Raises:
            Refusal: the owner refused.
            NoAnswer: the owner does not run or does not answer.
        """
        return self.send(topic, request, timeout)()

    def send(
        self, topic: Query[RequestT, ReplyT], request: RequestT, timeout: float | None = None
    ) -> Callable[[], ReplyT]:
        """Send `request`, and return a function that waits for the reply and returns or raises as `ask` does."""
        wait = timeout if timeout is not None else topic.timeout_s
        replies = self.session.get(self.key(topic.key), payload=encode(request), encoding=ENCODING, timeout=wait)
        return lambda: self.read(topic, next(iter(replies), None))

    def send_to(
        self,
        topic: Query[RequestT, ReplyT],
        request: RequestT,
        callback: Callable[[zenoh.Reply | None], object],
        timeout: float | None = None,
    ) -> None:
        """Send `request` as `ask` does; the reply, for `read`, goes to `callback` in Zenoh's thread, and None last."""
        handler = zenoh.handlers.Callback(callback, drop=lambda: callback(None), indirect=False)
        wait = timeout if timeout is not None else topic.timeout_s
        self.session.get(self.key(topic.key), handler, payload=encode(request), encoding=ENCODING, timeout=wait)

    def read(self, topic: Query[RequestT, ReplyT], reply: zenoh.Reply | None) -> ReplyT:
        """Return the message in a reply, None without a reply, or raise the errors of `ask`."""
        if reply is not None and reply.ok is not None:
            return decode(reply.ok.payload.to_bytes(), topic.reply, max_bytes=1 << 26)
        if reply is not None and reply.err is not None:
            raise self._refusal(topic, reply.err)
        raise NoAnswer(topic.owner, self.key(topic.key))

    def announce(self, service: str) -> zenoh.LivelinessToken:
        """Declare the liveliness token of `service`, which is then ready for requests, until it is withdrawn."""
        return self._keep(self.session.liveliness().declare_token(self.key(alive_key(service))))

    def withdraw(self, declared: zenoh.LivelinessToken | zenoh.Subscriber) -> None:
        """Undeclare a token that was announced, or a subscriber, unless the session is closed."""
        self._kept.remove(declared)
        if not self.closed:
            declared.undeclare()

    def claim(self, service: str, timeout: float = CLAIM_TIMEOUT_S) -> bool:
        """Claim to be the only instance of `service` while the session lives; return whether it is the only one.

        Every session declares its claim before it queries others, so if two start at once, at least one sees the other.
        The session with the larger id withdraws at once. The other waits up to `timeout` s for that, then withdraws.
        A session that withdrew queries once more: if both did, the last one sees no other, and claims again.

        Raises:
            NoAnswer: the router is silent.
        """
        own = self._own_claim(service)
        token = self._keep(self.session.liveliness().declare_token(own))
        deadline = time.monotonic() + timeout
        while others := self.rivals(service):
            if min(others) < own or time.monotonic() > deadline:
                self.withdraw(token)  # so that the other does not wait for this process to end
                return not self.rivals(service) and self.claim(service, timeout)
            time.sleep(CLAIM_PERIOD_S)
        return True

    def rivals(self, service: str) -> set[str]:
        """Return the full keys of other sessions' claims to be `service`; none without a router.

        Raises:
            NoAnswer: the router is silent.
        """
        return self._alive(claim_key(service, "*")) - {self._own_claim(service)}

    def on_return(self, callback: Callable[[], object]) -> None:
        """Call `callback`, in a thread of its own, whenever the session has lost its router and reconnected."""

        def receive(event: zenoh.TransportEvent) -> None:
            if event.kind == zenoh.SampleKind.PUT and event.transport.whatami == zenoh.WhatAmI.ROUTER:
                threading.Thread(target=callback, daemon=True).start()

        self._keep(self.session.info.declare_transport_events_listener(receive))

    def is_alive(self, service: str, timeout: float = LIVELINESS_S) -> bool:
        """Return whether the token of `service` is declared on the bus; False if the router does not answer.

        Do not call it in a session that watches the same token: Zenoh then answers from the events of the watch.
        """
        with contextlib.suppress(NoAnswer):
            return bool(self._alive(alive_key(service), timeout))
        return False

    def watch_alive(self, key: str, callback: Callable[[str, bool], object]) -> None:
        """Call `callback` with the key of every token on `key` that exists or appears (True) or disappears (False)."""
        self._keep(
            self.session.liveliness().declare_subscriber(
                self.key(key),
                lambda sample: callback(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT),
                history=True,
            )
        )

    def _own_claim(self, service: str) -> str:
        return self.key(claim_key(service, str(self.session.zid())))

    def _alive(self, key: str, timeout: float = LIVELINESS_S) -> set[str]:
        """Return the full keys of the tokens that are held on `key`."""
        found = set()
        for reply in self.session.liveliness().get(self.key(key), timeout=timeout):
            if reply.ok is None:
                raise NoAnswer("router", self.key(key))
            found.add(str(reply.ok.key_expr))
        return found

    def _keep(self, declared: Item) -> Item:
        self._kept.append(declared)
        return declared

    def _refusal(self, topic: Query, error: zenoh.ReplyError) -> Exception:
        try:
            body = decode(error.payload.to_bytes(), m.ErrorBody)
            return Refusal(body.code, body.message, **body.detail)
        except (Refusal, KeyError, TypeError):  # Zenoh's own error: its timeout
            return NoAnswer(topic.owner, self.key(topic.key), f"the {topic.owner} runs, but did not reply in time")
