"""Every line of the permission table is tested over TLS, both ways.

The tests show without waiting that a refused message does not arrive. Zenoh delivers in order: once the router has
answered the sender of the refused message, and a permitted message that was sent afterwards has arrived, the refused
one would have arrived before it.
"""

from collections.abc import Iterator
from contextlib import ExitStack
from queue import SimpleQueue

import pytest
import zenoh
from cell import STRANGERS, SecureCell
from harness import PATIENCE_S, SERVICES
from participants import BY_NAME, Participants, at_once, fence, may, replies, up_to

from protocol import topics

EVERYBODY = pytest.mark.parametrize("who", [*BY_NAME, *STRANGERS])
TOKENS = ("client/shell", *(f"{name}{claim}" for name in (*SERVICES, "recorder", "striker") for claim in ("", "/2a")))


@pytest.fixture(scope="module")
def people(cell: SecureCell) -> Iterator[Participants]:
    """Yield a bus with the permission table, and every participant on it."""
    with ExitStack() as stack:
        stack.enter_context(cell.host())
        yield Participants(cell, stack)


@EVERYBODY
def test_publishing(people: Participants, who: str):
    """Only the owner's messages arrive; nobody can delete, and a wildcard reaches nobody."""
    sender = people.bus(who, "act")
    for topic in topics.PUBLICATIONS:
        key = sender.key(topic.key)
        sender.session.put(key, who.encode())
        sender.session.delete(key)
        sender.session.put(f"{key[:-1]}$*", b"wildcard")
        fence(sender)
        people.owner(topic).session.put(key, b"last")
        expected = [(key, who.encode())] if may(who, "put", topic.key) else []
        assert up_to(people.heard, (key, b"last")) == expected, topic.key


@EVERYBODY
def test_subscribing(people: Participants, who: str):
    """Every role receives every publication once, a stranger none."""
    listener = people.bus(who, "listen")
    got: SimpleQueue[bytes] = SimpleQueue()
    for topic in topics.PUBLICATIONS:
        key = listener.key(topic.key)
        subscriber = listener.session.declare_subscriber(
            key, at_once(lambda sample: got.put(sample.payload.to_bytes()))
        )
        fence(listener)
        people.publish(topic, b"news")
        fence(listener)
        subscriber.undeclare()
        assert got.qsize() == may(who, "declare_subscriber", topic.key), topic.key
        while not got.empty():
            assert got.get() == b"news"


@EVERYBODY
@pytest.mark.parametrize("wide", ["**", "volley/**", "volley/arm/**", "volley/arm/*"])
def test_eavesdropping(people: Participants, who: str, wide: str):
    """A subscription to more than the table's keys receives nothing."""
    listener = people.bus(who, "listen")
    got: SimpleQueue[bytes] = SimpleQueue()
    subscriber = listener.session.declare_subscriber(wide, at_once(lambda sample: got.put(sample.payload.to_bytes())))
    fence(listener)
    people.publish(topics.STATE, b"news")
    fence(listener)
    subscriber.undeclare()
    assert got.empty()


@EVERYBODY
def test_asking(people: Participants, who: str):
    """A request arrives at its owner if the table permits it, and nowhere otherwise."""
    sender = people.bus(who, "act")
    for topic in topics.QUERIES:
        key = sender.key(topic.key)
        allowed = may(who, "query", topic.key)
        assert replies(sender, key, who.encode()) == [b"owner"] * allowed, topic.key
        assert replies(people.asker(topic), key, b"last") == [b"owner"]
        assert up_to(people.arrived, (key, b"last")) == [(key, who.encode())] * allowed, topic.key


@EVERYBODY
def test_asking_with_wildcards(people: Participants, who: str):
    """The router forwards no request with a wildcard, which could pass the table."""
    sender = people.bus(who, "act")
    for wide in ("**", "volley/**", "volley/arm/*", "volley/*/cancel", "volley/arm/c$*"):
        assert replies(sender, wide, b"wide") == []
    key = sender.key(topics.CANCEL.key)
    assert replies(people.asker(topics.CANCEL), key, b"last") == [b"owner"]
    assert up_to(people.arrived, (key, b"last")) == []


@EVERYBODY
def test_answering(people: Participants, who: str):
    """Only the owner's queryable receives requests."""
    impostor = people.bus(who, "act")

    def answer(query: zenoh.Query) -> None:
        with query:
            query.reply(query.key_expr, b"another")

    for topic in topics.QUERIES:
        key = impostor.key(topic.key)
        queryable = impostor.session.declare_queryable(key, answer, complete=True)
        fence(impostor)
        allowed = may(who, "declare_queryable", topic.key)
        assert replies(people.asker(topic), key, b"last") == [b"another"] * allowed + [b"owner"], topic.key
        queryable.undeclare()
        fence(impostor)
        up_to(people.arrived, (key, b"last"))


@EVERYBODY
def test_being_alive(people: Participants, who: str):
    """A role can declare its own token alone, so it cannot keep another service from starting."""
    sender, ear = people.bus(who, "act"), people.bus("viewer", "ear")
    for token in TOKENS:
        held = sender.session.liveliness().declare_token(sender.key(topics.alive_key(token)))
        fence(sender)
        assert ear.is_alive(token) == may(who, "liveliness_token", topics.alive_key(token)), token
        held.undeclare()
        fence(sender)
        assert not ear.is_alive(token)


@EVERYBODY
def test_asking_who_is_alive(people: Participants, who: str):
    """Every role may ask for tokens; a stranger receives no answer."""
    asker, holder = people.bus(who, "listen"), people.bus("planner", "act")
    seen: SimpleQueue[str] = SimpleQueue()
    token = holder.session.liveliness().declare_token(holder.key(topics.alive_key("planner")))
    fence(holder)
    assert asker.is_alive("planner", timeout=PATIENCE_S if who in BY_NAME else 1.0) == (who in BY_NAME)
    watch = asker.session.liveliness().declare_subscriber(
        asker.key(topics.alive_key("*")), at_once(lambda sample: seen.put(str(sample.key_expr))), history=True
    )
    fence(asker)
    assert seen.qsize() == (who in BY_NAME)
    watch.undeclare()
    token.undeclare()
    fence(holder)
