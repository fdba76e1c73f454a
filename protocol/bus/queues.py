"""Bounded queues between Zenoh's threads and the loop that owns a process's state."""

import time
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Generic, TypeVar

import zenoh

from protocol.topics import QUEUE_LENGTH, SMALL

Item = TypeVar("Item")


class Inbox(Generic[Item]):
    """A bounded first-in, first-out queue.

    `wake` is called after an item has entered the empty queue; it can wake a loop that waits for another event.
    """

    def __init__(self, length: int = QUEUE_LENGTH, wake: Callable[[], object] | None = None) -> None:
        self._queue: SimpleQueue[Item] = SimpleQueue()
        self._length = length
        self._wake = wake

    def offer(self, item: Item) -> bool:
        """Append `item`, or return False if the queue is full."""
        if self._queue.qsize() >= self._length:
            return False
        self._queue.put(item)
        if self._wake is not None and self._queue.qsize() == 1:
            self._wake()
        return True

    @property
    def is_empty(self) -> bool:
        """Whether nothing waits."""
        return self._queue.empty()

    def take(self, timeout: float | None = 0.0) -> Item | None:
        """Return the oldest item, or None after waiting `timeout` s (None: without limit)."""
        if timeout == 0.0 and self._queue.empty():
            return None
        try:
            return self._queue.get(block=timeout != 0.0, timeout=timeout)
        except Empty:
            return None


class Stream:
    """The newest `length` bodies of a stream; older ones are dropped.

    Zenoh's thread puts each sample into the queue without running Python code of this project, because a second
    computing thread would delay the loop.
    """

    def __init__(self, length: int = QUEUE_LENGTH) -> None:
        self._queue: SimpleQueue[zenoh.Sample | None] = SimpleQueue()
        self._length = length
        self.callback = zenoh.handlers.Callback(self._queue.put, indirect=False)

    def wake(self) -> None:
        """Make a waiting `take` return None at once."""
        self._queue.put(None)

    def take(self, timeout: float = 0.0) -> bytes | None:
        """Return the oldest body, or None after waiting `timeout` s or after `wake`."""
        if timeout <= 0.0 and self._queue.empty():
            return None
        try:
            while self._queue.qsize() > self._length:
                self._queue.get_nowait()
            sample = self._queue.get(block=timeout > 0.0, timeout=timeout)
        except Empty:
            return None
        if sample is None:
            return None
        payload = sample.payload
        return payload.to_bytes() if len(payload) <= SMALL else b""  # too large to copy within a tick: refused as empty

    def take_all(self) -> list[bytes]:
        """Return the bodies that are there now, the oldest first."""
        taken = (self.take() for _ in range(self._queue.qsize()))
        return [body for body in taken if body is not None]


class Collector:
    """The newest samples of a topic, in a ring channel of Zenoh; older ones are dropped."""

    def __init__(self, subscriber: zenoh.Subscriber) -> None:
        self._subscriber = subscriber

    def take(self) -> tuple[bytes, int] | None:
        """Return the oldest body and the time at the router (Unix ns; now, if the router adds none), or None."""
        sample = self._subscriber.try_recv()
        if sample is None:
            return None
        stamp = sample.timestamp
        received_ns = stamp.get_time_as_ntp64().as_nanos() if stamp else time.time_ns()
        return sample.payload.to_bytes(), received_ns

    def drop(self) -> bool:
        """Drop the oldest sample without copying its body; return whether there was one."""
        return self._subscriber.try_recv() is not None
