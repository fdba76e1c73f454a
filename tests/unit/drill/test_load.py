"""Counting replies under a flood of requests."""

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
def frequent_switches():
    """Minimise the interpreter's switch interval between threads."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(usual)


@pytest.mark.usefixtures("frequent_switches")
def test_simultaneous_replies_are_all_counted():
    """Zenoh delivers replies in several threads; the first replies of a code are counted, too."""
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


def test_a_reply_is_accepted_or_has_the_code_of_its_refusal():
    body = encode(m.ErrorBody(code="busy", message="full", detail={}))
    err = SimpleNamespace(payload=SimpleNamespace(to_bytes=lambda: body))
    assert code_in(SimpleNamespace(ok=None, err=err)) == "busy"  # type: ignore[arg-type]
    assert code_in(SimpleNamespace(ok=SimpleNamespace(), err=None)) == ACCEPTED  # type: ignore[arg-type]


def test_a_request_without_an_answer_counts_as_silent():
    """Zenoh's error after a timeout is plain text; on a busy machine it sometimes comes twice."""
    endpoint, kept = free_endpoint(), []
    with open_session(listen=[endpoint]) as owner, open_session([endpoint]) as client:
        owner.declare_queryable("goal", kept.append)
        replies = list(client.get("goal", timeout=0.2))
        assert kept
        assert {code_in(reply) for reply in replies} == {NO_REPLY}
