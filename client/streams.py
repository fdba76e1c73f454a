"""What services publish, one message after the other."""

from collections.abc import AsyncIterator, Iterator
from typing import Generic, Self

from client.link import Link
from client.mailboxes import Mailbox
from client.twofold import Awaits, Blocks, Twofold
from protocol.codec import decode
from protocol.topics import MessageT, Publication

LENGTH = 1024
"""Messages that a stream keeps by default: a second of the arm's states."""
MAX_BYTES = 1 << 26
"""Largest message that is decoded: a plan of 60 s has 17 MB."""


class StreamEnded(Exception):
    """The stream or its connection was closed."""


class Listening(Generic[MessageT]):
    """What `Stream` and `AsyncStream` have in common; closed by its `with` block, or with its connection."""

    def __init__(self, link: Link, topic: Publication[MessageT], length: int = LENGTH) -> None:
        self.topic = topic
        self._box: Mailbox[bytes | None] = link.mailbox(length)
        self._close = link.stream(topic, self._box)

    @Twofold
    async def take(self, timeout: float | None = None) -> MessageT:
        """Return the oldest message that was not yet taken, after waiting up to `timeout` s for one.

        Args:
            timeout: 0 does not wait; None waits without end.

        Raises:
            TimeoutError: there was none.
            StreamEnded: the stream was closed, or its connection, and what came before is taken.
            Refusal: `bad_message`, where a message cannot be read; the next one may be.
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
        """Stop listening; an iteration ends, in another thread too."""
        close, self._close = self._close, lambda: None
        close()


class Stream(Listening[MessageT], Blocks):
    """The messages of a topic since the stream was opened, until it is closed; the oldest are dropped first."""

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


class AsyncStream(Listening[MessageT], Awaits):
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
