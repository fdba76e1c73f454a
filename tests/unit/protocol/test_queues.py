"""Queues between Zenoh's threads and a loop: bounds and order."""

from protocol.bus.queues import Inbox, Stream
from protocol.bus.sessions import open_session
from services.common.cli import free_endpoint


def test_inbox_is_bounded_and_in_order():
    inbox = Inbox[int](length=2)
    assert [inbox.offer(item) for item in (1, 2, 3)] == [True, True, False]
    assert [inbox.take(), inbox.take(0.001), inbox.take(), inbox.take(0.001)] == [1, 2, None, None]


def test_an_inbox_calls_wake_once_for_an_item_that_enters_it_empty():
    """So a flood does not wake the loop repeatedly."""
    woken: list[str] = []
    inbox = Inbox[int](length=2, wake=lambda: woken.append("up"))
    assert [inbox.offer(item) for item in (1, 2, 3)] == [True, True, False]
    assert woken == ["up"]
    assert (inbox.take(), inbox.take()) == (1, 2)
    inbox.offer(4)
    assert woken == ["up", "up"]


def test_waking_a_stream_returns_none_and_loses_no_message():
    stream = Stream()
    with open_session(listen=[free_endpoint()]) as session:
        subscriber = session.declare_subscriber("numbers", stream.callback)
        stream.wake()
        session.put("numbers", b"1")
        subscriber.undeclare()
    assert [stream.take(60.0), stream.take(60.0), stream.take()] == [None, b"1", None]


def test_stream_drops_the_oldest():
    stream = Stream(length=2)
    with open_session(listen=[free_endpoint()]) as session:
        subscriber = session.declare_subscriber("numbers", stream.callback)
        for body in (b"1", b"2", b"3"):
            session.put("numbers", body)
        subscriber.undeclare()
    assert [stream.take(), stream.take(0.001), stream.take(), stream.take(0.001)] == [b"2", b"3", None, None]
