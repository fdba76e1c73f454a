"""Waiting, in its two forms: a thread that blocks, and a coroutine that is awaited.

Every method of the library is written once, as a coroutine that waits for nothing but mailboxes. On a blocking
connection a mailbox blocks the thread, so the coroutine ends without having been suspended; on an asynchronous one it
suspends the coroutine.
"""

from __future__ import annotations

import contextlib
import functools
import queue
import time
from collections.abc import Callable, Coroutine
from types import MethodType
from typing import TYPE_CHECKING, Any, Concatenate, Generic, ParamSpec, Protocol, TypeVar, overload

if TYPE_CHECKING:
    import asyncio

P = ParamSpec("P")
R = TypeVar("R")
Item = TypeVar("Item")


class Blocks:
    """Base of the classes whose `Twofold` methods block."""


class Awaits:
    """Base of the classes whose `Twofold` methods are awaited."""


class Mailbox(Protocol[Item]):
    """Where another thread leaves items for the one who waits."""

    def put(self, item: Item) -> None:
        """Leave an item; of more than the mailbox holds the oldest is dropped. Called from any thread."""
        ...

    async def take(self, timeout: float | None = None) -> Item:
        """Return the oldest item, after waiting up to `timeout` s for one, without end where it is None.

        Raises:
            TimeoutError: there was none.
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
    """A mailbox whose `take` suspends the coroutine; to be made while its event loop runs."""

    def __init__(self, length: int) -> None:
        import asyncio

        self._loop = asyncio.get_running_loop()
        self._items: asyncio.Queue[Item] = asyncio.Queue(length)

    def put(self, item: Item) -> None:
        """Leave an item."""
        with contextlib.suppress(RuntimeError):  # the event loop has ended, so nobody waits
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


class Twofold(Generic[P, R]):
    """A method that is written as a coroutine: awaited on `Awaits`, and run to its end on `Blocks`."""

    def __init__(self, body: Callable[Concatenate[Any, P], Coroutine[Any, Any, R]]) -> None:
        @functools.wraps(body)
        def blocking(self: object, *args: P.args, **kwargs: P.kwargs) -> R:
            return run(body(self, *args, **kwargs))

        self._awaited, self._blocking = body, blocking
        self.__doc__ = body.__doc__

    @overload
    def __get__(self, instance: Blocks, owner: type | None = None) -> Callable[P, R]: ...
    @overload
    def __get__(self, instance: Awaits, owner: type | None = None) -> Callable[P, Coroutine[Any, Any, R]]: ...
    @overload
    def __get__(self, instance: object, owner: type | None = None) -> Callable[..., Any]: ...
    def __get__(self, instance: object, owner: type | None = None) -> Callable[..., Any]:
        method = self._awaited if issubclass(owner or type(instance), Awaits) else self._blocking
        return method if instance is None else MethodType(method, instance)


def run(coroutine: Coroutine[Any, Any, R]) -> R:
    """Return what a coroutine returns that waits for blocking mailboxes alone."""
    try:
        coroutine.send(None)
    except StopIteration as ended:
        return ended.value
    coroutine.close()
    raise RuntimeError("a blocking method waited for an event loop")


class Deadline:
    """A moment that is `timeout` s away, or never comes where that is None."""

    def __init__(self, timeout: float | None) -> None:
        self._at = None if timeout is None else time.monotonic() + timeout

    def remaining(self, at_most: float) -> float:
        """Return the time until then, s, 0 once it has passed; no more than `at_most`."""
        return at_most if self._at is None else max(0.0, min(at_most, self._at - time.monotonic()))

    def has_passed(self) -> bool:
        """Return whether that moment has come."""
        return self._at is not None and time.monotonic() >= self._at
