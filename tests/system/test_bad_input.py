"""Bad input over the wire is refused with a code and a sentence; nothing moves and every process stays alive."""

import math
import os
from collections.abc import Iterable, Iterator
from typing import Any

import msgpack
import pytest
import zenoh
from harness import PATIENCE_S, Stack, wait_for
from msgspec.structs import replace

from protocol import messages as m
from protocol import topics
from protocol.codec import encode, matrix_bytes
from protocol.errors import NoAnswer
from robot.description import load_robot

ROBOT = load_robot()
HOME = ROBOT.home.tolist()
JOINTS = ROBOT.joint_count
HUGE = 1.7e308
TRIES = 3
NOISE_BYTES = os.urandom(16 << 20)
ALSO = ("striker",)
QUERIES = pytest.mark.parametrize("topic", topics.QUERIES, ids=lambda topic: topic.key)


@pytest.fixture(scope="module")
def survivors(services: Stack) -> Iterator[Stack]:
    """Yield the module's services; after all tests of this module they must still play a good goal."""
    yield services
    services.reset()
    assert services.finish(services.goal(primitive="forehand", positions=HOME, duration=0.3)).outcome == "succeeded"


@pytest.fixture
def stack(survivors: Stack) -> Iterator[Stack]:
    """Yield the module's services; after the test they must be alive, answer, and the arm must stand at home."""
    survivors.reset()
    yield survivors
    wait_for(lambda: answers(survivors), "an answer from every service")
    assert survivors.services.ended() == {}
    survivors.step(20)
    assert survivors.state().positions == pytest.approx(HOME, abs=1e-6)


def pack(body: object) -> bytes:
    """Return `body` as msgpack."""
    data = msgpack.packb(body)
    assert data is not None
    return data


def answers(stack: Stack) -> bool:
    """Return whether planner, controller and sim each answer a request that reads."""
    try:
        return bool(stack.state() and stack.status() and stack.bus.ask(topics.PRIMITIVES, m.Empty()))
    except NoAnswer:
        return False


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
        wait_for(lambda: answers(stack), "an answer from every service")
    raise AssertionError(f"{key} did not answer")


def refuse(stack: Stack, key: str, code: str, field: str | None, **body: object) -> dict[str, Any]:
    """Send a map and check that its refusal has `code`, and names `field` in its detail and in its sentence."""
    refusal = send(stack, key, pack(body))
    assert refusal["code"] == code, refusal
    if field is not None:
        assert refusal["detail"]["field"].startswith(field), refusal
        assert field in refusal["message"], refusal
    return refusal


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


@QUERIES
def test_too_many_bytes(stack: Stack, topic: topics.Query):
    """Refuse 16 MiB of noise, and a map whose one field already fills the topic's limit."""
    assert send(stack, topic.key, NOISE_BYTES)["code"] == "bad_message"
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


GOAL = {"primitive": "forehand", "positions": HOME}
NOT_A_NUMBER = [math.nan, *HOME[1:]]


@pytest.mark.parametrize(
    ("code", "field", "body"),
    [
        ("bad_message", "primitive", {"positions": HOME}),
        ("bad_message", "primitive", {**GOAL, "primitive": 7}),
        ("bad_message", "positions", {**GOAL, "positions": "home"}),
        ("bad_message", "positions[2]", {**GOAL, "positions": [0.0, 0.0, "x", 0.0, 0.0, 0.0]}),
        ("bad_message", "positions", {**GOAL, "positions": HOME[:5]}),
        ("bad_message", "positions[0]", {**GOAL, "positions": NOT_A_NUMBER}),
        ("bad_message", "velocities", {**GOAL, "velocities": [0.0] * 7}),
        ("bad_message", "velocities[5]", {**GOAL, "velocities": [0.0] * 5 + [math.inf]}),
        ("bad_message", "accelerations", {**GOAL, "accelerations": [None]}),
        ("bad_message", "duration", {**GOAL, "duration": -math.inf}),
        ("bad_message", "duration", {**GOAL, "duration": "1 s"}),
        ("bad_message", "limits.velocities", {**GOAL, "limits": {"velocities": [1.0]}}),
        ("bad_message", "limits.positions", {**GOAL, "limits": {"positions": [None] * 5}}),
        ("bad_message", "limits.speeds", {**GOAL, "limits": {"speeds": [1.0] * JOINTS}}),
        ("bad_message", "waypoints[0].time_from_start", {**GOAL, "waypoints": [{}]}),
        ("bad_message", "waypoints[0].positions", {**GOAL, "waypoints": [{"time_from_start": 0.5, "positions": [1]}]}),
        ("bad_message", "start.positions", {**GOAL, "plan_only": True, "start": {"positions": []}}),
        ("bad_message", "tail", {**GOAL, "tail": "roll"}),
        ("bad_message", "plan_only", {**GOAL, "plan_only": 1}),
        ("invalid_goal", "duration", {**GOAL, "duration": 0.0}),
        ("invalid_goal", "duration", {**GOAL, "duration": -1}),
        ("invalid_goal", "duration", {**GOAL, "duration": 60.1}),
        ("invalid_goal", "duration", {**GOAL, "duration": 1e-300}),
        ("invalid_goal", "duration", {**GOAL, "duration": HUGE}),
        ("invalid_goal", "arrival_time", {**GOAL, "duration": 1.0, "arrival_time": 1.0}),
        ("invalid_goal", "arrival_time", {**GOAL, "arrival_time": HUGE}),
        ("invalid_goal", "start", {**GOAL, "start": {"positions": HOME}}),
        ("invalid_goal", "tail", {**GOAL, "tail": "coast"}),
        ("invalid_goal", "client_id", {**GOAL, "lease": True}),
        ("invalid_goal", "goal_id", {**GOAL, "goal_id": ""}),
        ("invalid_goal", "goal_id", {**GOAL, "goal_id": "x" * 129}),
        ("invalid_goal", "rest_fraction", {**GOAL, "rest_fraction": 1.0}),
        ("invalid_goal", "rest_fraction", {**GOAL, "rest_fraction": -HUGE}),
        ("invalid_goal", "accelerations", {**GOAL, "rest_fraction": 0.2, "accelerations": [1.0] + [None] * 5}),
        ("invalid_goal", "waypoints[0].time_from_start", {**GOAL, "waypoints": [{"time_from_start": 2.0}]}),
        ("invalid_goal", "waypoints[0].time_from_start", {**GOAL, "waypoints": [{"time_from_start": HUGE}]}),
        ("invalid_goal", "limits.velocities", {**GOAL, "limits": {"velocities": [0.0] + [None] * 5}}),
        ("invalid_goal", "limits.jerks", {**GOAL, "limits": {"jerks": [-HUGE] + [None] * 5}}),
        ("invalid_goal", "limits.positions", {**GOAL, "limits": {"positions": [[1.0, -1.0]] + [None] * 5}}),
        ("invalid_goal", "limits.positions", {**GOAL, "limits": {"positions": [[90.0, 99.0]] + [None] * 5}}),
        ("unknown_primitive", None, {**GOAL, "primitive": "backhand"}),
        ("unknown_primitive", None, {**GOAL, "primitive": "../forehand"}),
        ("late", None, {**GOAL, "arrival_time": 0.0}),
        ("late", None, {**GOAL, "arrival_time": -HUGE}),
    ],
)
def test_goals(stack: Stack, code: str, field: str | None, body: dict[str, object]):
    """A goal that is malformed or contradicts itself is refused; the refusal names the field."""
    refuse(stack, "goal", code, field, **body)


@pytest.mark.parametrize(
    ("quantity", "fields"),
    [
        ("position", {"positions": [HUGE, *HOME[1:]]}),
        ("position", {"positions": [-2.6, *HOME[1:]], "velocities": [1.0] + [0.0] * 5}),
        ("velocity", {"velocities": [15.1] + [0.0] * 5}),
        ("velocity", {"velocities": [-HUGE] + [0.0] * 5}),
        ("acceleration", {"velocities": [1.0] + [0.0] * 5, "accelerations": [-301.0] + [None] * 5}),
        ("acceleration", {"velocities": [1.0] + [0.0] * 5, "accelerations": [HUGE] + [None] * 5}),
        ("position", {"waypoints": [{"time_from_start": 0.5, "positions": [HUGE] + [None] * 5}]}),
        ("velocity", {"waypoints": [{"time_from_start": 0.5, "velocities": [16.0] + [None] * 5}]}),
        ("position", {"limits": {"positions": [[0.1, 0.5]] + [None] * 5}}),
        ("position", {"plan_only": True, "start": {"positions": [3.0, *HOME[1:]]}}),
    ],
)
def test_goals_outside_the_limits(stack: Stack, quantity: str, fields: dict[str, object]):
    """The refusal `limit` names the joint, the quantity, the value and the bound."""
    refusal = refuse(stack, "goal", "limit", None, **GOAL | fields)
    detail = refusal["detail"]
    assert (detail["joint"], detail["quantity"]) == ("joint_1", quantity)
    assert abs(detail["value"] - detail["bound"]) > 0
    assert "joint_1" in refusal["message"]


def demonstration(samples: int = 100) -> list[list[float]]:
    """Return a small movement of every joint."""
    return [[math.sin(3.0 * k / samples)] * JOINTS for k in range(samples)]


@pytest.mark.parametrize(
    ("code", "field", "body"),
    [
        ("bad_message", "name", {}),
        ("bad_message", "name", {"name": "../escape"}),
        ("bad_message", "name", {"name": ""}),
        ("bad_message", "name", {"name": "x" * 65}),
        ("bad_message", "positions", {"positions": []}),
        ("bad_message", "positions", {"positions": [[0.0] * 6, [0.0] * 5]}),
        ("bad_message", "positions", {"positions": [[]]}),
        ("bad_message", "positions", {"positions": [[0.0] * 6] * 2}),
        ("bad_message", "positions[3][1]", {"positions": [*demonstration(3), [0.0, math.nan]]}),
        ("bad_message", "positions", {"positions": [[HUGE * (-1) ** k] * 6 for k in range(100)]}),
        ("bad_message", "positions", {"positions": b"", "joint_count": 6}),
        ("bad_message", "joint_count", {"positions": bytes(48)}),
        ("bad_message", "joint_count", {"positions": bytes(48), "joint_count": 0}),
        ("bad_message", "positions", {"positions": bytes(47), "joint_count": 6}),
        ("bad_message", "positions", {"positions": bytes(48), "joint_count": 1 << 60}),
        ("bad_message", "positions", {"positions": matrix_bytes(ROBOT.home * math.nan), "joint_count": 6}),
        ("bad_message", "rate", {"rate": None}),
        ("bad_message", "rate", {"rate": 0.0}),
        ("bad_message", "rate", {"rate": -HUGE}),
        ("bad_message", "rate", {"rate": 1e-308}),
        ("bad_message", "rate", {"rate": HUGE}),
        ("bad_message", "times", {"rate": None, "times": [k * 1e-300 for k in range(100)]}),
        ("bad_message", "times", {"rate": None, "times": [0.0, 0.1]}),
        ("bad_message", "times", {"rate": None, "times": [0.0] * 100}),
        ("bad_message", "smoothing", {"smoothing": "much"}),
        ("bad_message", "smoothing", {"smoothing": {"window_s": -1.0, "order": 3}}),
        ("bad_message", "smoothing", {"smoothing": {"window_s": HUGE, "order": 3}}),
        ("bad_message", "smoothing.order", {"smoothing": {"window_s": 0.9, "order": 80}}),
        ("exists", None, {"name": "forehand"}),
    ],
)
def test_demonstrations(stack: Stack, code: str, field: str | None, body: dict[str, object]):
    """A demonstration that cannot be learned is refused; the refusal names the field and the library is unchanged."""
    good: dict[str, object] = {"name": "wave", "positions": demonstration(), "rate": 100.0}
    whole = {} if field == "name" and not body else {**good, **body}
    refuse(stack, "learn", code, field, **whole)
    assert [entry.name for entry in stack.bus.ask(topics.PRIMITIVES, m.Empty()).primitives] == ["forehand"]


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
