"""Messages that are too large or too deep for the services."""

import msgpack
from harness import PATIENCE_S, ROBOT, Stack

from protocol import topics

ALSO = ("striker",)


def pack(body: object) -> bytes:
    """Return `body` as msgpack."""
    data = msgpack.packb(body)
    assert data is not None
    return data


def refusals(stack: Stack, key: str, body: bytes, timeout: float = PATIENCE_S) -> list[str]:
    """Send a body and return the codes of the refusals; "taken" stands for a reply, "silent" for a timeout."""
    replies = stack.bus.session.get(stack.bus.key(key), payload=body, timeout=timeout)
    codes = []
    for reply in replies:
        answer = reply.ok or reply.err
        assert answer is not None
        body = answer.payload.to_bytes()
        codes.append("taken" if reply.ok else "silent" if body == b"Timeout" else msgpack.unpackb(body)["code"])
    return codes


def test_more_than_a_message_may_have(stack: Stack):
    """64 MiB never reach a service, whose connection stays open; 17 MiB reach it and are refused."""
    assert refusals(stack, "learn", bytes(64 << 20), timeout=2.0) == ["silent"]
    assert refusals(stack, "learn", bytes(17 << 20)) == ["bad_message"]
    for topic in (topics.STATE, topics.COMMAND, topics.STATUS):
        stack.bus.session.put(stack.bus.key(topic.key), bytes(64 << 20))
    assert stack.finish(stack.goal(duration=0.3)).outcome == "succeeded"
    assert stack.services.ended() == {}


def test_a_nesting_bomb(stack: Stack):
    """A million nested arrays are refused as a body and in a field; published, they harm no service."""
    for bomb in (b"\x91" * 1_000_000, b"\x81\xa1a" + b"\x91" * 1_000_000, b"\x81\xa1a" * 300_000):
        for topic in topics.QUERIES:
            assert refusals(stack, topic.key, bomb) == ["bad_message"], topic.key
        for topic in topics.PUBLICATIONS:
            stack.bus.session.put(stack.bus.key(topic.key), bomb)
    assert stack.finish(stack.goal(duration=0.3)).outcome == "succeeded"
    assert stack.services.ended() == {}


def test_a_million_samples(stack: Stack):
    """A trajectory that claims a million samples is refused; 48 MB of demonstration never reach the planner."""
    names, samples = list(ROBOT.joint_names), bytes(8 * 6 * 27_000)
    trajectory = {"goal_id": "endless", "epoch": 0, "joint_names": names, "start_time": 1.0, "dt": 0.001}
    trajectory |= {"count": 1_000_000, "hit_index": 999_999}
    trajectory |= dict.fromkeys(("positions", "velocities", "accelerations"), samples)
    assert refusals(stack, "execute", pack(trajectory)) == ["bad_message"]
    assert refusals(stack, "learn", pack({"name": "endless", "positions": bytes(8 * 6_000_000)}), 2.0) == ["silent"]
    assert stack.finish(stack.goal(duration=0.3)).outcome == "succeeded"
    assert stack.services.ended() == {}
