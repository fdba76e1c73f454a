"""Queues between Zenoh's threads and the loop that owns a process's state."""

import time
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Generic, TypeVar

import zenoh

from protocol.topics import QUEUE_LENGTH, SMALL

Item = TypeVar("Item")


class Inbox(Generic[Item]):
    """A bounded queue between Zenoh's threads and the loop that owns the state.

    `wake` is called after an item has come into an empty queue, for a loop that waits for something else.
    """

    def __init__(self, length: int = QUEUE_LENGTH, wake: Callable[[], object] | None = None) -> None:
        self._queue: SimpleQueue[Item] = SimpleQueue()
        self._length = length
        self._wake = wake

    def offer(self, item: Item) -> bool:
        """Append `item`, or return False where the queue is full."""
        if self._queue.qsize() >= self._length:
            return False
        self._queue.put(item)
        if self._wake is not None and self._queue.qsize() == 1:
            self._wake()
        return True

    def take(self, timeout: float | None = 0.0) -> Item | None:
        """Return the oldest item, after waiting up to `timeout` s for one (None: for ever), or None."""
        if timeout == 0.0 and self._queue.empty():
            return None
        try:
            return self._queue.get(block=timeout != 0.0, timeout=timeout)
        except Empty:
            return None


class Stream:
    """The newest bodies of a stream, to be waited for; of more than `length` the oldest are dropped first.

    Zenoh's own thread puts each sample into the queue without running any Python of ours, since a second thread that
    computes delays the loop that waits.
    """

    def __init__(self, length: int = QUEUE_LENGTH) -> None:
        self._queue: SimpleQueue[zenoh.Sample | None] = SimpleQueue()
        self._length = length
        self.callback = zenoh.handlers.Callback(self._queue.put, indirect=False)

    def wake(self) -> None:
        """Let a `take` that waits return at once."""
        self._queue.put(None)

    def take(self, timeout: float = 0.0) -> bytes | None:
        """Return the oldest body, after waiting up to `timeout` s for one, or None, also where `wake` was called."""
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
        return payload.to_bytes() if len(payload) <= SMALL else b""  # too large to be copied in a tick, and refused


class Collector:
    """The newest samples of a topic, kept by Zenoh itself until they are taken; the oldest are dropped first."""

    def __init__(self, subscriber: zenoh.Subscriber) -> None:
        self._subscriber = subscriber

    def take(self) -> tuple[bytes, int] | None:
        """Return the oldest body and when the hub had it (Unix ns; now, where the hub stamps nothing), or None."""
        sample = self._subscriber.try_recv()
        if sample is None:
            return None
        stamp = sample.timestamp
        received_ns = stamp.get_time_as_ntp64().as_nanos() if stamp else time.time_ns()
        return sample.payload.to_bytes(), received_ns

    def drop(self) -> bool:
        """Drop the oldest sample without copying its body, and return whether there was one."""
        return self._subscriber.try_recv() is not None
