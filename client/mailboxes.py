"""Bounded queues from one thread to another, or to a coroutine."""

from __future__ import annotations

import contextlib
import queue
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    import asyncio

Item = TypeVar("Item")


class Mailbox(Protocol[Item]):
    """Bounded queue that another thread fills."""

    def put(self, item: Item) -> None:
        """Add an item; a full mailbox drops its oldest item. Called from any thread."""
        ...

    async def take(self, timeout: float | None = None) -> Item:
        """Remove and return the oldest item; wait up to `timeout` s for one, or without a timeout if it is None.

        Raises:
            TimeoutError: no item arrived in time.
        """
        ...


class BlockingMailbox(Generic[Item]):
    """A mailbox whose `take` blocks the thread."""

    def __init__(self, length: int) -> None:
        self._items: queue.SimpleQueue[Item] = queue.SimpleQueue()
        self._length = length

    def put(self, item: Item) -> None:
        """Leave an item."""
        if self._items.qsize() >= self._length:
            with contextlib.suppress(queue.Empty):
                self._items.get_nowait()
        self._items.put(item)

    async def take(self, timeout: float | None = None) -> Item:
        """Return the oldest item."""
        try:
            return self._items.get(block=timeout is None or timeout > 0.0, timeout=timeout or None)
        except queue.Empty:
            raise TimeoutError from None


class AwaitedMailbox(Generic[Item]):
    """A mailbox whose `take` suspends the coroutine; create it while its event loop runs."""

    def __init__(self, length: int) -> None:
        import asyncio

        self._loop = asyncio.get_running_loop()
        self._items: asyncio.Queue[Item] = asyncio.Queue(length)

    def put(self, item: Item) -> None:
        """Leave an item."""
        with contextlib.suppress(RuntimeError):  # the event loop has ended: there is no reader
            self._loop.call_soon_threadsafe(self._append, item)

    async def take(self, timeout: float | None = None) -> Item:
        """Return the oldest item."""
        if not self._items.empty():
            return self._items.get_nowait()
        import asyncio

        async with asyncio.timeout(timeout):
            return await self._items.get()

    def _append(self, item: Item) -> None:
        if self._items.full():
            self._items.get_nowait()
        self._items.put_nowait(item)
