"""Methods in two forms: blocking, and awaited.

Every method of the library is written once, as a coroutine that waits only for mailboxes. On a blocking connection a
mailbox blocks the thread, so the coroutine finishes without being suspended; on an asynchronous connection the
mailbox suspends the coroutine.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Coroutine
from types import MethodType
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, overload

P = ParamSpec("P")
R = TypeVar("R")


class Sync:
    """Base of the classes whose `SyncOrAsync` methods block."""


class Async:
    """Base of the classes whose `SyncOrAsync` methods are awaited."""


class SyncOrAsync(Generic[P, R]):
    """A method written as a coroutine: awaited on `Async`, run to its end on `Sync`."""

    def __init__(self, body: Callable[Concatenate[Any, P], Coroutine[Any, Any, R]]) -> None:
        @functools.wraps(body)
        def blocking(self: object, *args: P.args, **kwargs: P.kwargs) -> R:
            return run(body(self, *args, **kwargs))

        self._awaited, self._blocking = body, blocking
        self.__doc__ = body.__doc__

    @overload
    def __get__(self, instance: Sync, owner: type | None = None) -> Callable[P, R]: ...
    @overload
    def __get__(self, instance: Async, owner: type | None = None) -> Callable[P, Coroutine[Any, Any, R]]: ...
    @overload
    def __get__(self, instance: object, owner: type | None = None) -> Callable[..., Any]: ...
    def __get__(self, instance: object, owner: type | None = None) -> Callable[..., Any]:
        method = self._awaited if issubclass(owner or type(instance), Async) else self._blocking
        return method if instance is None else MethodType(method, instance)


def run(coroutine: Coroutine[Any, Any, R]) -> R:
    """Run a coroutine that waits only for blocking mailboxes, and return its result."""
    try:
        coroutine.send(None)
    except StopIteration as ended:
        return ended.value
    coroutine.close()
    raise RuntimeError("a blocking method waited for an event loop")
