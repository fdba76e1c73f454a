"""Replies that the drill counts under a flood of requests."""

import sys
import threading
from types import SimpleNamespace

import pytest

from protocol import messages as m
from protocol.bus.sessions import open_session
from protocol.codec import encode
from services.common.cli import free_endpoint
from tools.drill.harness.cell import ACCEPTED
from tools.drill.harness.flood import NO_REPLY, Flood, code_in

THREADS = 8


@pytest.fixture
def hasty():
    """Make threads take turns as often as possible."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(usual)


@pytest.mark.usefixtures("hasty")
def test_replies_that_come_at_once_all_count():
    """Zenoh delivers replies in threads; simultaneous ones are all counted, also the first of a kind."""
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


def test_codes_in_replies():
    """A refusal has its own code."""
    body = encode(m.ErrorBody(code="busy", message="full", detail={}))
    err = SimpleNamespace(payload=SimpleNamespace(to_bytes=lambda: body))
    assert code_in(SimpleNamespace(ok=None, err=err)) == "busy"  # type: ignore[arg-type]
    assert code_in(SimpleNamespace(ok=SimpleNamespace(), err=None)) == ACCEPTED  # type: ignore[arg-type]


def test_an_owner_without_an_answer_is_silent():
    """Zenoh's own error after a timeout is plain text."""
    endpoint, kept = free_endpoint(), []
    with open_session(listen=[endpoint]) as owner, open_session([endpoint]) as client:
        owner.declare_queryable("goal", kept.append)
        (reply,) = client.get("goal", timeout=0.2)
        assert kept
        assert code_in(reply) == NO_REPLY
