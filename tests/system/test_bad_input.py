"""Bodies that are not a message and requests with bad fields are refused, and the services go on."""

import math
import os
from collections.abc import Iterable

import msgpack
import pytest
import zenoh
from harness import PATIENCE_S, Stack, wait_for
from msgspec.structs import replace
from refusing import HOME, HUGE, pack, refuse, send

from protocol import messages as m
from protocol import topics
from protocol.codec import encode

ALSO = ("striker",)
pytestmark = pytest.mark.usefixtures("unharmed")

NOISE_BYTES = os.urandom(16 << 20)
QUERIES = pytest.mark.parametrize("topic", topics.QUERIES, ids=lambda topic: topic.key)


@QUERIES
def test_bodies_that_are_not_a_message(stack: Stack, topic: topics.Query):
    """Refuse bodies that are not one msgpack map, have keys that are not strings, another version or unknown fields."""
    assert "123" in send(stack, topic.key, b"{")["message"]
    bodies = [b"\x90", b"\xc0", b"\xa4goal", b"\xc1", b"\x85\xa1a", b"\x81\x01\x02", pack({}) + b"\x00"]
    for body in bodies:
        refusal = send(stack, topic.key, body)
        assert refusal["code"] == "bad_message", (body, refusal)
    for body, field in (({"version": 2}, "version"), ({"colour": "red"}, "colour"), ({"version": "1"}, "version")):
        refusal = send(stack, topic.key, pack(body))
        assert refusal["code"] == "bad_message"
        assert refusal["detail"]["field"] == field
        assert field in refusal["message"]
    deep: list = []
    for _ in range(600):
        deep = [deep]
    assert send(stack, topic.key, pack({"a": deep}))["code"] == "bad_message"


@pytest.mark.parametrize("owner", sorted({topic.owner for topic in topics.QUERIES}))
def test_noise_of_16_mib(stack: Stack, owner: str):
    topic = next(topic for topic in topics.QUERIES if topic.owner == owner)
    assert send(stack, topic.key, NOISE_BYTES)["code"] == "bad_message"


@QUERIES
def test_too_many_bytes(stack: Stack, topic: topics.Query):
    """Refuse a map whose one field already fills the topic's limit."""
    refusal = send(stack, topic.key, pack({"name": "x" * topic.max_bytes}))
    assert str(topic.max_bytes) in refusal["message"]


@QUERIES
def test_wildcards(stack: Stack, topic: topics.Query):
    """A request that changes something is refused because of its wildcard; one that reads, only because of its body."""
    wild = stack.bus.key(topic.key)[:-1] + "$*"
    sentences = []
    for reply in stack.bus.session.get(wild, payload=b"{", timeout=PATIENCE_S):
        assert reply.err is not None
        sentences.append(msgpack.unpackb(reply.err.payload.to_bytes())["message"])
    assert any(
        ("wildcard" in sentence and stack.bus.key(topic.key) in sentence) != topic.reads for sentence in sentences
    )


@pytest.mark.parametrize(
    ("key", "code", "field", "body"),
    [
        ("forget", "unknown_primitive", None, {"name": "backhand"}),
        ("result", "unknown_goal", None, {"goal_id": "never"}),
        ("cancel", "unknown_goal", None, {"goal_id": "never"}),
        ("cancel", "bad_message", "goal_id", {"goal_id": 7}),
        ("reference", "bad_message", "lead", {"lead": -1.0}),
        ("reference", "bad_message", "lead", {"lead": HUGE}),
        ("reference", "bad_message", "lead", {"lead": math.nan}),
        ("sim/step", "bad_message", "ticks", {"ticks": 0}),
        ("sim/step", "bad_message", "ticks", {"ticks": 10_001}),
        ("sim/step", "bad_message", "ticks", {"ticks": 1.5}),
        ("sim/step", "bad_message", "ticks", {"ticks": True}),
        ("sim/reset", "bad_message", "positions", {"positions": [0.0] * 5}),
        ("sim/reset", "limit", None, {"positions": [9.0, *HOME[1:]]}),
        ("sim/reset", "bad_message", "seed", {"seed": -1}),
        ("sim/reset", "bad_message", "ball.position", {"ball": {"position": [0.0, 0.0]}}),
        ("sim/reset", "bad_message", "ball", {"ball": {"position": [HUGE, 0.0, 0.0]}}),
        ("sim/reset", "bad_message", "ball", {"ball": {"position": [1.0, 0.0, 1.0], "velocity": [HUGE, 0.0, 0.0]}}),
        ("sim/disturb", "bad_message", "kind", {"kind": "earthquake"}),
        ("sim/disturb", "bad_message", "values", {"kind": "torque", "duration": 1.0}),
        ("sim/disturb", "bad_message", "values", {"kind": "torque", "values": [1.0], "duration": 1.0}),
        ("sim/disturb", "bad_message", "values", {"kind": "torque", "values": [HUGE] * 6, "duration": 1.0}),
        ("sim/disturb", "bad_message", "values", {"kind": "acceleration", "values": [-HUGE] * 6, "duration": 1.0}),
        ("sim/disturb", "bad_message", "duration", {"kind": "torque", "values": [0.0] * 6, "duration": 0.0}),
        ("sim/disturb", "bad_message", "duration", {"kind": "torque", "values": [0.0] * 6, "duration": HUGE}),
        (
            "sim/disturb",
            "bad_message",
            "start_time",
            {"kind": "torque", "values": [0.0] * 6, "duration": 1.0, "start_time": HUGE},
        ),
        (
            "sim/disturb",
            "bad_message",
            "start_time",
            {"kind": "torque", "values": [0.0] * 6, "duration": 1.0, "start_time": -1.0},
        ),
        ("sim/disturb", "bad_message", "position_std", {"kind": "sensor_noise", "position_std": -1.0}),
        ("sim/disturb", "bad_message", "position_std", {"kind": "sensor_noise", "position_std": HUGE}),
        ("sim/disturb", "bad_message", "velocity_std", {"kind": "sensor_noise", "velocity_std": HUGE}),
        ("sim/disturb", "bad_message", "drop_rate", {"kind": "ball_noise", "drop_rate": 1.5}),
        ("sim/disturb", "bad_message", "latency_s", {"kind": "ball_noise", "latency_s": -1.0}),
        ("sim/disturb", "bad_message", "velocity_std", {"kind": "ball_noise", "velocity_std": 1.0}),
        ("sim/ball", "bad_message", "position", {"position": [HUGE, 0.0, 1.0], "velocity": [0.0] * 3}),
        ("sim/ball", "bad_message", "position", {"position": [2.0, 0.0, -1.0], "velocity": [0.0] * 3}),
        ("sim/ball", "bad_message", "velocity", {"position": [2.0, 0.0, 1.0]}),
        ("sim/ball", "bad_message", "velocity[0]", {"position": [2.0, 0.0, 1.0], "velocity": [math.nan, 0.0, 0.0]}),
        ("sim/ball", "bad_message", "spin", {"position": [2.0, 0.0, 1.0], "velocity": [0.0] * 3, "spin": [HUGE] * 3}),
        ("sim/disturb", "bad_message", "stream", {"kind": "loss", "duration": 0.1}),
        ("sim/disturb", "bad_message", "duration", {"kind": "loss", "stream": "state", "duration": HUGE}),
        (
            "sim/disturb",
            "bad_message",
            "start_time",
            {"kind": "loss", "stream": "state", "duration": 1.0, "start_time": 1.0},
        ),
    ],
)
def test_other_requests(stack: Stack, key: str, code: str, field: str | None, body: dict[str, object]):
    """Requests other than goals and demonstrations are refused for a bad field as well."""
    refuse(stack, key, code, field, **body)


NOISE = (b"{", b"", b"\xc1" * 100, os.urandom(1 << 16), bytes(16 << 20), pack({}), pack({"run": 0, "tick": 1e300}))


def test_noise_published_on_state(stack: Stack):
    """The controller refuses and counts each message; it keeps holding."""
    before = stack.status().cycle.refused
    publish(stack, topics.STATE.key, NOISE)
    wait_for(lambda: stack.status().cycle.refused >= before + len(NOISE), "the controller to count the noise")
    assert stack.status().mode == "holding"


def test_noise_published_on_command(stack: Stack):
    """The sim ignores noise.

    Commands of another run, tick or length or with absurd values do not move the arm either.
    """
    stack.step(1)
    command = m.Command(
        run=stack.run, tick=1, source="noise", accelerations=[9.0] * 6, positions=HOME, velocities=HOME, goal_id=None
    )
    absurd: list[dict[str, object]] = [
        {"run": stack.run + 1},
        {"tick": 0},
        {"tick": 1 << 60},
        {"accelerations": [9.0] * 5},
        {"accelerations": [HUGE] * 6, "tick": 2},
    ]
    publish(stack, topics.COMMAND.key, [*NOISE, *(encode(replace(command, **change)) for change in absurd)])
    stack.step(200)


def publish(stack: Stack, key: str, bodies: Iterable[bytes]) -> None:
    """Publish bodies as an unknown client would, in order and without dropping any."""
    for body in bodies:
        stack.bus.session.put(stack.bus.key(key), body, congestion_control=zenoh.CongestionControl.BLOCK)
