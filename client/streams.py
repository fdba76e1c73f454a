"""Streams of published messages."""

from collections.abc import AsyncIterator, Iterator
from typing import Generic, Self

from client.link import Link
from client.mailboxes import Mailbox
from client.sync_or_async import Async, Sync, SyncOrAsync
from protocol.codec import decode
from protocol.topics import MessageT, Publication

LENGTH = 1024
"""Default capacity of a stream, messages: one second of the arm's states."""
MAX_BYTES = 1 << 26
"""Largest message that is decoded: a plan of 60 s has 17 MB."""


class StreamEnded(Exception):
    """The stream or its connection was closed."""


class StreamBase(Generic[MessageT]):
    """Base of `Stream` and `AsyncStream`; its `with` block or its connection closes it."""

    def __init__(self, link: Link, topic: Publication[MessageT], length: int = LENGTH) -> None:
        self.topic = topic
        self._box: Mailbox[bytes | None] = link.mailbox(length)
        self._close = link.stream(topic, self._box)

    @SyncOrAsync
    async def take(self, timeout: float | None = None) -> MessageT:
        """Remove and return the oldest message in the stream; wait for one if it is empty.

        Args:
            timeout: Timeout, s; 0: do not wait; None: no timeout.

        Raises:
            TimeoutError: no message arrived in time.
            StreamEnded: the stream or its connection was closed, and all earlier messages are taken.
            Refusal: `bad_message`, if a message cannot be decoded; later ones may be valid.
        """
        try:
            body = await self._box.take(timeout)
        except TimeoutError:
            raise TimeoutError(f"no {self.topic.key} within {timeout:g} s") from None
        if body is None:
            self._box.put(None)  # for the next take
            raise StreamEnded(f"the stream of {self.topic.key} is closed")
        return decode(body, self.topic.message, MAX_BYTES)

    def close(self) -> None:
        """Unsubscribe; iterations end, also in other threads."""
        self._close()


class Stream(StreamBase[MessageT], Sync):
    """The messages of a topic from opening to closing, as an iterator; a full stream drops its oldest message."""

    def __iter__(self) -> Iterator[MessageT]:
        return self

    def __next__(self) -> MessageT:
        try:
            return self.take()
        except StreamEnded:
            raise StopIteration from None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class AsyncStream(StreamBase[MessageT], Async):
    """A `Stream` as an asynchronous iterator."""

    def __aiter__(self) -> AsyncIterator[MessageT]:
        return self

    async def __anext__(self) -> MessageT:
        try:
            return await self.take()
        except StreamEnded:
            raise StopAsyncIteration from None

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        self.close()
