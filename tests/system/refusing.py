"""Send requests that must be refused."""

from typing import Any

import msgpack
from harness import PATIENCE_S, ROBOT, Stack, wait_for

HOME = ROBOT.home.tolist()
JOINTS = ROBOT.joint_count
HUGE = 1.7e308
TRIES = 3


def pack(body: object) -> bytes:
    """Return `body` as msgpack."""
    data = msgpack.packb(body)
    assert data is not None
    return data


def send(stack: Stack, key: str, body: bytes) -> dict[str, Any]:
    """Send a body and return the refusal; anything else fails the test.

    The router closes the session of a service that accepts no data for 0.5 s, which may happen on a busy machine while
    16 MiB are sent. The body is then sent again once the service is back.
    """
    for _ in range(TRIES):
        for reply in stack.bus.session.get(stack.bus.key(key), payload=body, timeout=PATIENCE_S):
            assert reply.ok is None, f"{key} took {body[:60]!r}: {msgpack.unpackb(reply.ok.payload.to_bytes())}"
            assert reply.err is not None
            refusal = msgpack.unpackb(reply.err.payload.to_bytes())
            assert set(refusal) == {"code", "message", "detail"}
            assert len(refusal["message"]) <= 400
            return refusal
        wait_for(stack.answers, "an answer from every service")
    raise AssertionError(f"{key} did not answer")


def refuse(stack: Stack, key: str, code: str, field: str | None, **body: object) -> dict[str, Any]:
    """Send a map and check that its refusal has `code`, and names `field` in its detail and in its sentence."""
    refusal = send(stack, key, pack(body))
    assert refusal["code"] == code, refusal
    if field is not None:
        assert refusal["detail"]["field"].startswith(field), refusal
        assert field in refusal["message"], refusal
    return refusal
