"""A robot that replies with golden messages over real Zenoh; clients are tested with it, without services."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import pytest
from msgspec import Struct

from protocol.bus.bus import Bus, Publisher
from protocol.bus.pending_query import PendingQuery
from protocol.bus.queues import Inbox
from protocol.bus.sessions import SERVICE, open_session
from protocol.errors import Refusal
from protocol.topics import DESCRIPTION, PUBLICATIONS, QUERIES, MessageT, Publication
from services.common.cli import free_endpoint
from tests.golden.examples import EXAMPLES


@dataclass
class Stub:
    """A robot that answers every request with the golden message of the reply's type, unless a test sets another one.

    Attributes:
        bus: The bus that it hosts.
        endpoint: The endpoint of the bus.
        asked: Keys and requests received, `description` excepted.
        described: Number of requests for `description`.
        answers: For a key, the next answers in order.
        then: For a key, a message that is published once after the reply, and its topic.
        silent: Keys that are not answered.
    """

    bus: Bus
    endpoint: str
    publishers: dict[str, Publisher]
    asked: list[tuple[str, Struct]] = field(default_factory=list)
    described: int = 0
    answers: dict[str, list[Struct | Refusal]] = field(default_factory=dict)
    then: dict[str, tuple[Publication, Struct]] = field(default_factory=dict)
    silent: set[str] = field(default_factory=set)

    def answer(self, query: PendingQuery) -> None:
        """Answer one request."""
        key = query.topic.key
        try:
            request = query.decode()
        except Refusal as refusal:
            query.refuse(refusal)
            return
        if key == DESCRIPTION.key:
            self.described += 1
        else:
            self.asked.append((key, request))
        if key in self.silent:
            return
        planned = self.answers.get(key)
        answer = planned.pop(0) if planned else EXAMPLES[query.topic.reply.__name__]
        if isinstance(answer, Refusal):
            query.refuse(answer)
        else:
            query.reply(answer)
        if key in self.then:
            self.publish(*self.then.pop(key))

    def publish(self, topic: Publication[MessageT], message: MessageT) -> None:
        """Publish a message."""
        self.publishers[topic.key].put(message)


@dataclass(frozen=True, slots=True)
class Router:
    """The stub's bus, which all tests of a module share."""

    bus: Bus
    endpoint: str
    inbox: Inbox[PendingQuery]
    publishers: dict[str, Publisher]


@contextmanager
def hosted() -> Iterator[Router]:
    """Host a bus on which every request is served."""
    endpoint = free_endpoint()
    with Bus(open_session(listen=[endpoint], timeouts=SERVICE)) as bus:
        inbox = Inbox[PendingQuery]()
        for query in QUERIES:
            bus.serve(query, inbox)
        yield Router(bus, endpoint, inbox, {topic.key: bus.publisher(topic) for topic in PUBLICATIONS})


@contextmanager
def answering(router: Router) -> Iterator[Stub]:
    """Answer requests on the router until the block ends."""
    stub = Stub(router.bus, router.endpoint, router.publishers)
    stopping = threading.Event()

    def serve() -> None:
        while not stopping.is_set():
            query = router.inbox.take(0.02)
            if query is not None:
                stub.answer(query)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield stub
    finally:
        stopping.set()
        thread.join()


@pytest.fixture(scope="module")
def router() -> Iterator[Router]:
    """Yield a router for the stubs of a module."""
    with hosted() as router:
        yield router


@pytest.fixture
def robot(router: Router) -> Iterator[Stub]:
    """Yield a stub for one test."""
    with answering(router) as stub:
        yield stub
