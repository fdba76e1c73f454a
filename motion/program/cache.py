"""A cache with a limit on its bytes, because one hull of 400 functions is as large as a hundred hulls of 20."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import wraps
from threading import Lock
from typing import Any, TypeVar

import numpy as np

Result = TypeVar("Result")


def cached_within(most: int) -> Callable[[Callable[..., Result]], Callable[..., Result]]:
    """Cache a function of hashable arguments: keep the last used results whose arrays fit in `most` bytes.

    The latest result is always kept.
    """

    def decorate(function: Callable[..., Result]) -> Callable[..., Result]:
        kept: OrderedDict[tuple[Any, ...], tuple[Result, int]] = OrderedDict()
        lock, total = Lock(), 0

        @wraps(function)
        def call(*key: Any) -> Result:
            nonlocal total
            with lock:
                if key in kept:
                    kept.move_to_end(key)
                    return kept[key][0]
            result = function(*key)
            with lock:
                if key not in kept:
                    kept[key] = result, size_of(result)
                    total += kept[key][1]
                while total > most and len(kept) > 1:
                    total -= kept.popitem(last=False)[1][1]
            return result

        return call

    return decorate


def size_of(value: Any) -> int:
    """Bytes of the arrays in an array, a dataclass, a list or a tuple."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if is_dataclass(value):
        return sum(size_of(getattr(value, field.name)) for field in fields(value))
    return sum(map(size_of, value)) if isinstance(value, list | tuple) else 0
