"""Replies that the drill counts under a flood."""

import sys
import threading
from types import SimpleNamespace

import pytest

from tools.drill.harness.flood import Flood

THREADS = 8


@pytest.fixture
def hasty():
    """Threads that take turns as often as they can."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(usual)


@pytest.mark.usefixtures("hasty")
def test_replies_that_come_at_once_all_count():
    """Each in a thread of its own, as Zenoh delivers them; the first of a kind at once too."""
    floods = [Flood(None, "goal") for _ in range(1000)]  # type: ignore[arg-type]
    reply = SimpleNamespace(ok=SimpleNamespace(), err=None)
    start = threading.Barrier(THREADS)

    def deliver() -> None:
        for flood in floods:
            start.wait()
            flood.count(reply)  # type: ignore[arg-type]

    threads = [threading.Thread(target=deliver) for _ in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [len(flood.codes) for flood in floods] == [THREADS] * len(floods)
