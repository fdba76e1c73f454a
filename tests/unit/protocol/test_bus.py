"""The bus over real Zenoh: requests, replies, refusals, publications and tokens."""

import threading
from collections.abc import Callable, Iterator

import msgpack
import pytest
import zenoh

from protocol import messages as m
from protocol.bus.bus import Bus
from protocol.bus.pending_query import PendingQuery
from protocol.bus.queues import Inbox, Stream
from protocol.bus.sessions import open_session
from protocol.codec import ENCODING, encode
from protocol.errors import NoAnswer, Refusal
from protocol.topics import CANCEL, CONTACT, PRIMITIVES, QUEUE_LENGTH, STATE, STATUS_QUERY, alive_key
from tests.golden.examples import EXAMPLES
from tests.golden.values import STATUS
from tools.drill.harness.waiting import PATIENCE_S, eventually


@pytest.fixture
def client(router: Bus, endpoint: str) -> Iterator[Bus]:
    with Bus(open_session(connect=[endpoint])) as bus:
        yield bus


@pytest.fixture
def inbox() -> Inbox[PendingQuery]:
    return Inbox()


def answering(inbox: Inbox[PendingQuery], answer: Callable[[PendingQuery], None]) -> threading.Thread:
    """Start a thread that answers the next request of `inbox`, and return it."""

    def serve() -> None:
        pending = inbox.take(PATIENCE_S)
        assert pending is not None
        answer(pending)

    thread = threading.Thread(target=serve)
    thread.start()
    return thread


def refuse_unknown_goal(pending: PendingQuery) -> None:
    pending.refuse(Refusal("unknown_goal", "no goal is called wipe-3; ask for one of forehand-7", goal_id="wipe-3"))


def test_a_request_gets_its_reply(router, client, inbox):
    router.serve(STATUS_QUERY, inbox)
    thread = answering(inbox, lambda pending: pending.reply(STATUS))
    assert client.ask(STATUS_QUERY, m.Empty()) == STATUS
    thread.join()


def test_a_request_is_received_as_sent(router, client, inbox):
    router.serve(CANCEL, inbox)
    seen = []

    def answer(pending: PendingQuery) -> None:
        seen.append(pending.decode())
        pending.reply(m.Canceled(goal_id="forehand-7", stop_time=1.0))

    thread = answering(inbox, answer)
    client.ask(CANCEL, m.Cancel(goal_id="forehand-7"))
    thread.join()
    assert seen == [m.Cancel(goal_id="forehand-7")]


def test_a_refusal_reaches_the_client_with_message_and_detail(router, client, inbox):
    router.serve(CANCEL, inbox)
    thread = answering(inbox, refuse_unknown_goal)
    with pytest.raises(Refusal, match="ask for one of forehand-7") as refused:
        client.ask(CANCEL, m.Cancel(goal_id="wipe-3"))
    thread.join()
    assert (refused.value.code, refused.value.detail) == ("unknown_goal", {"goal_id": "wipe-3"})


def test_a_request_without_payload_and_encoding_is_served(router, client, inbox):
    """As sent by zenoh-cli; the reply's encoding is msgpack."""
    router.serve(CANCEL, inbox)

    def answer(pending: PendingQuery) -> None:
        pending.reply(m.Canceled(goal_id=pending.decode().goal_id, stop_time=0.5))

    thread = answering(inbox, answer)
    (reply,) = client.session.get("volley/arm/cancel", timeout=PATIENCE_S)
    thread.join()
    assert str(reply.ok.encoding) == ENCODING
    assert msgpack.unpackb(reply.ok.payload.to_bytes()) == {"version": 1, "goal_id": None, "stop_time": 0.5}


def test_a_malformed_request_is_refused_when_decoded(router, client, inbox):
    router.serve(CANCEL, inbox)

    def answer(pending: PendingQuery) -> None:
        try:
            pending.decode()
        except Refusal as refusal:
            pending.refuse(refusal)

    thread = answering(inbox, answer)
    (reply,) = client.session.get("volley/arm/cancel", payload=b"{", timeout=PATIENCE_S)
    thread.join()
    body = msgpack.unpackb(reply.err.payload.to_bytes())
    assert (body["code"], body["detail"]) == ("bad_message", {"field": ""})
    assert "int 123" in body["message"]


def test_wildcard_requests_are_served_only_if_they_change_nothing(router, client, inbox):
    router.serve(CANCEL, inbox)
    (reply,) = client.session.get("volley/*/cancel", timeout=PATIENCE_S)
    body = msgpack.unpackb(reply.err.payload.to_bytes())
    assert (body["code"], body["detail"]) == ("bad_message", {"field": "key"})
    assert "send this request to volley/arm/cancel" in body["message"]
    assert inbox.take() is None

    router.serve(STATUS_QUERY, inbox)
    thread = answering(inbox, lambda pending: pending.reply(STATUS))
    replies = client.session.get("volley/*/status", timeout=PATIENCE_S)
    assert [str(reply.ok.key_expr) for reply in replies] == ["volley/arm/status"]
    thread.join()


def test_requests_sent_as_publications_are_reported(router, client, inbox):
    """They cannot be answered and are not served."""
    for query in (CANCEL, PRIMITIVES, STATUS_QUERY):
        router.serve(query, inbox)
    assert router.take_puts() == []
    for key in ("cancel", "cancel", "status", "goal"):
        client.session.put(client.key(key), b"\x80", congestion_control=zenoh.CongestionControl.BLOCK)
    noticed: list[str] = []
    eventually(lambda: noticed.extend(router.take_puts()) or noticed)
    assert set(noticed) == {"volley/arm/cancel"}
    assert inbox.take() is None


def test_robots_do_not_receive_each_others_requests(router, endpoint, inbox):
    router.serve(STATUS_QUERY, inbox)
    with Bus(open_session(connect=[endpoint]), "leg") as other, pytest.raises(NoAnswer, match="volley/leg/status"):
        other.ask(STATUS_QUERY, m.Empty())
    assert inbox.take() is None


def test_requests_beyond_a_full_inbox_are_refused_at_once(router, client):
    taken: list[bool] = []

    class Counted(Inbox[PendingQuery]):
        def offer(self, item: PendingQuery) -> bool:
            taken.append(super().offer(item))
            return taken[-1]

    router.serve(PRIMITIVES, Counted())
    for _ in range(QUEUE_LENGTH):
        client.ask_later(PRIMITIVES, m.Empty(), lambda body: None)
    assert eventually(lambda: taken == [True] * QUEUE_LENGTH)
    with pytest.raises(Refusal, match=f"planner has {QUEUE_LENGTH} requests waiting") as refused:
        client.ask(PRIMITIVES, m.Empty())
    assert refused.value.code == "busy"


def test_an_absent_service_is_reported_at_once(client):
    with pytest.raises(NoAnswer, match="volley/arm/status: the controller is not running") as unanswered:
        client.ask(STATUS_QUERY, m.Empty())
    assert unanswered.value.service == "controller"


def test_a_service_that_does_not_answer_is_reported_after_the_timeout(router, client, inbox):
    router.serve(STATUS_QUERY, inbox)
    with pytest.raises(NoAnswer, match=r"volley/arm/status: the controller runs, but did not reply in time$"):
        client.ask(STATUS_QUERY, m.Empty(), timeout=0.2)
    assert inbox.take(PATIENCE_S) is not None


def test_ask_later_passes_the_body_of_the_reply(router, client, inbox):
    router.serve(STATUS_QUERY, inbox)
    bodies = []
    client.ask_later(STATUS_QUERY, m.Empty(), bodies.append)
    pending = inbox.take(PATIENCE_S)
    assert pending is not None
    pending.reply(STATUS)
    assert eventually(lambda: bodies)
    assert msgpack.unpackb(bodies[0])["mode"] == "tracking"


@pytest.mark.parametrize(("topic", "message"), [(STATE, EXAMPLES["State"]), (CONTACT, EXAMPLES["Contact"])])
def test_publications_are_received(router, client, topic, message):
    stream = Stream()
    client.stream(topic, stream)
    publisher = router.publisher(topic, blocking=True)
    received = []

    def arrived() -> bool:
        publisher.put(message)
        received.append(stream.take(0.05))
        return received[-1] is not None

    assert eventually(arrived)
    assert received[-1] == encode(message)


def test_announcements_are_visible_and_watched(router, client, endpoint):
    seen = []
    router.watch_alive(alive_key("client/shell"), lambda key, alive: seen.append((key, alive)))
    assert not client.is_alive("sim")
    router.announce("sim")
    assert eventually(lambda: client.is_alive("sim"))
    with Bus(open_session(connect=[endpoint])) as other:
        other.announce("client/shell")
        assert eventually(lambda: seen == [("volley/arm/alive/client/shell", True)])
    assert eventually(lambda: [alive for _, alive in seen] == [True, False])


def test_a_client_waits_for_a_router_and_reconnects_after_its_restart(endpoint, inbox):
    patience = iter(range(3))
    with pytest.raises(zenoh.ZError, match="Unable to connect"):
        open_session(connect=[endpoint], give_up=lambda: next(patience) == 1)
    assert next(patience) == 2

    with Bus(open_session(listen=[endpoint])):
        client = Bus(open_session(connect=[endpoint]))
    with client, Bus(open_session(listen=[endpoint])) as router:
        router.serve(STATUS_QUERY, inbox)
        answers: list[m.Status] = []

        def asked() -> bool:
            client.ask_later(STATUS_QUERY, m.Empty(), lambda body: answers.append(msgpack.unpackb(body)))
            pending = inbox.take(0.1)
            if pending is not None:
                pending.reply(STATUS)
            return pending is not None

        assert eventually(asked)
        assert eventually(lambda: answers)


def test_an_endpoint_in_use_is_an_error(router, endpoint):
    with pytest.raises(zenoh.ZError):
        open_session(listen=[endpoint])
