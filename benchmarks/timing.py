"""Times and their summaries."""

import gc
import time
from collections.abc import Callable, Iterable
from typing import TypeVar

import numpy as np

AnswerT = TypeVar("AnswerT")


def timed(work: Callable[[], AnswerT]) -> tuple[float, AnswerT]:
    """Return the processor time of this thread, s, and the answer."""
    began = time.thread_time()
    answer = work()
    return time.thread_time() - began, answer


def seconds_of(works: Iterable[Callable[[], object]]) -> list[float]:
    """Return the processor time of each piece of work, s; garbage is collected before each, as the planner does."""
    seconds = []
    for work in works:
        gc.collect(1)
        seconds.append(timed(work)[0])
    return seconds


def milliseconds(seconds: list[float]) -> dict[str, float]:
    """Return median, 99th percentile and maximum."""
    values = np.array(seconds or [np.nan])
    return {"p50_ms": 1e3 * float(np.median(values)), "p99_ms": 1e3 * float(np.percentile(values, 99))} | {
        "max_ms": 1e3 * float(values.max())
    }
