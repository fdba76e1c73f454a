"""Robot time that is slower than the wall clock, for machines that are busy."""

import contextlib
import threading
import time
from collections.abc import Iterator

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.errors import NoAnswer, Refusal

STEP_TICKS = 2


@contextlib.contextmanager
def slow_motion(bus: Bus, slow: float) -> Iterator[None]:
    """Step the sim, `slow` times slower than the wall clock, for the length of the block; 1: do nothing."""
    ended = threading.Event()

    def step() -> None:
        due = time.monotonic()
        while not ended.is_set():
            with contextlib.suppress(Refusal, NoAnswer):
                bus.ask(topics.SIM_STEP, m.Step(ticks=STEP_TICKS))
            due = max(due + STEP_TICKS * 1e-3 * slow, time.monotonic() - 1.0)
            ended.wait(max(0.0, due - time.monotonic()))

    stepping = threading.Thread(target=step, daemon=True)
    if slow != 1.0:
        stepping.start()
    try:
        yield
    finally:
        ended.set()
        if stepping.is_alive():
            stepping.join()
