"""Validation of messages, and the order in which the recorder takes them."""

import struct
from typing import Any

import msgpack
import pytest

from protocol import messages as m
from protocol.codec import encode
from protocol.errors import Refusal
from protocol.topics import (
    BALL,
    COMMAND,
    DISTURBANCE,
    ENDED,
    PLAN,
    PUBLICATIONS,
    REFUSED,
    STATE,
    STATUS,
    STRIKES,
    Publication,
)
from services.recorder.validation import Receiver, read
from tests.unit.recorder.recorder_messages import MESSAGES, FakeStream

INF, NAN = float("inf"), float("nan")


RECORDED = tuple(topic for topic in PUBLICATIONS if topic.recorded)


def _pack(body: dict[str, Any]) -> bytes:
    return msgpack.packb(body) or b""


@pytest.mark.parametrize("topic", RECORDED, ids=lambda topic: topic.key)
def test_every_recorded_publication_round_trips(topic: Publication) -> None:
    assert read(topic, encode(MESSAGES[topic]), 6) == MESSAGES[topic]


@pytest.mark.parametrize("topic", RECORDED, ids=lambda topic: topic.key)
def test_unknown_fields_are_ignored(topic: Publication) -> None:
    body = msgpack.unpackb(encode(MESSAGES[topic])) | {"later": [1, {"version": 2}]}
    assert read(topic, _pack(body), 6) == MESSAGES[topic]


@pytest.mark.parametrize(
    ("topic", "field", "value"),
    [
        (STATE, "positions", [0.0] * 5),
        (STATE, "positions", [0.0, NAN, 0.0, 0.0, 0.0, 0.0]),
        (STATE, "torques", [INF, -INF, 0.0, 0.0, 0.0, 0.0]),
        (STATE, "positions", "abcdef"),
        (STATE, "tick", -1),
        (STATE, "tick", 1 << 62),
        (STATE, "run", 1 << 63),
        (STATE, "time", NAN),
        (STATE, "time", -1.0),
        (STATE, "saturated", [False]),
        (STATE, "truth", {"positions": [0.0], "velocities": [0.0] * 6}),
        (COMMAND, "accelerations", [0.0] * 7),
        (COMMAND, "velocities", [NAN] * 6),
        (COMMAND, "tick", 1.5),
        (PLAN, "positions", b"\0" * 8),
        (PLAN, "accelerations", struct.pack("<d", NAN) * 24),
        (PLAN, "hit_index", 4),
        (PLAN, "dt", 0.0),
        (PLAN, "dt", 1e-320),
        (PLAN, "dt", 100.0),
        (PLAN, "epoch", 1 << 63),
        (ENDED, "stamps", {"requested": 1, "accepted": 1 << 63}),
        (PLAN, "demonstration", b"\0" * 7),
        (PLAN, "start_time", 1e12),
        (PLAN, "waypoints", [{"time_from_start": 0.1, "positions": [0.0]}]),
        (REFUSED, "requested", 1 << 63),
        (REFUSED, "detail", None),
        (STATUS, "error", {"positions": [0.0], "velocities": [0.0]}),
        (ENDED, "hit", {"time": 1.0, "position_error": [0.0], "velocity_error": [0.0] * 6}),
        (BALL, "position", [0.0, NAN, 0.0]),
        (BALL, "position", [0.0, 0.0]),
        (BALL, "velocity", [0.0, 0.0, 1e308]),
        (DISTURBANCE, "active", [{"kind": "torque", "values": [1.0]}]),
        (DISTURBANCE, "active", [{"kind": "wind", "values": [1.0] * 6}]),
        (STRIKES, "landing", {"time": 6.0, "position": [1e7, 0.0, 0.0], "distance": 0.1}),
    ],
)
def test_a_message_that_cannot_be_written_is_refused_with_its_field(topic: Publication, field: str, value: Any) -> None:
    body = msgpack.unpackb(encode(MESSAGES[topic]))
    body[field] = value
    with pytest.raises(Refusal) as caught:
        read(topic, _pack(body), 6)
    assert field in str(caught.value)


def test_wind_with_six_values_is_refused_for_an_arm_of_six_joints() -> None:
    wind = m.Disturbance(time=1.0, active=[m.ActiveDisturbance(kind="wind", values=[1.0] * 6)])
    with pytest.raises(Refusal, match=r"^active\.values has 6 entries; space has 3$"):
        read(DISTURBANCE, encode(wind), 6)


def test_wind_with_three_values_is_accepted_for_an_arm_of_six_joints() -> None:
    wind = m.Disturbance(time=1.0, active=[m.ActiveDisturbance(kind="wind", values=[1.0, 0.0, 0.0])])
    assert read(DISTURBANCE, encode(wind), 6) == wind


@pytest.mark.parametrize("quantity", ["positions", "velocities"])
def test_invalid_limits_of_a_plan_are_refused(quantity: str) -> None:
    body = msgpack.unpackb(encode(MESSAGES[PLAN]))
    body["limits"][quantity] = ["far"] * 6
    with pytest.raises(Refusal, match=f"limits.{quantity}"):
        read(PLAN, _pack(body), 6)


@pytest.mark.parametrize("body", [b"", b"{", b"\xc1", b"\x80", b"\x80\x80", b"\xff" * 4096, msgpack.packb([1, 2])])
@pytest.mark.parametrize("topic", RECORDED, ids=lambda topic: topic.key)
def test_a_malformed_message_is_counted_and_the_next_is_read(topic: Publication, body: bytes) -> None:
    complaints: list[tuple[str, str]] = []
    sources = {each: FakeStream() for each in RECORDED}
    receiver = Receiver(sources, 6, lambda sentence, code: complaints.append((sentence, code)))
    for each in (body, encode(MESSAGES[topic])):
        sources[topic].append((each, 5))
    taken = receiver.take()[topic]
    assert [one.message for one in taken] == [MESSAGES[topic]]
    assert receiver.malformed == 1
    ((sentence, code),) = complaints
    assert topic.key in sentence
    assert code == "bad_message"


def test_states_are_taken_after_commands() -> None:
    """So the state that a command answers is never in a later batch than the command."""
    order: list[str] = []

    class OrderedSource(FakeStream):
        def __init__(self, topic: Publication) -> None:
            super().__init__()
            self._topic = topic

        def take(self) -> tuple[bytes, int] | None:
            order.append(self._topic.key)
            return super().take()

    Receiver({topic: OrderedSource(topic) for topic in RECORDED}, 6, lambda *_: None).take()
    assert order[-3:] == ["command", "state", "plan"]


def test_a_plan_is_in_the_same_batch_as_its_states() -> None:
    """Also if plan and states arrive while the batch is taken."""
    sources = {topic: FakeStream() for topic in RECORDED}

    class SlowSource(FakeStream):
        """A source of states; while its first is taken, a plan and another state arrive."""

        def take(self) -> tuple[bytes, int] | None:
            taken = super().take()
            if taken and taken[1] == 1:
                sources[PLAN].append((encode(MESSAGES[PLAN]), 2))
                self.append((encode(MESSAGES[STATE]), 3))
            return taken

    sources[STATE] = SlowSource([(encode(MESSAGES[STATE]), 1)])
    batch = Receiver(sources, 6, lambda *_: None).take()
    assert [one.wall_ns for one in batch[PLAN]] == [2]
    assert [one.wall_ns for one in batch[STATE]] == [1, 3]


def test_a_flood_of_plans_does_not_keep_a_batch_from_ending() -> None:
    """Plans that arrive faster than they are taken wait for the next batch."""

    class Flood(FakeStream):
        """A source that is filled again whenever it has been emptied."""

        fillings = 0

        def take(self) -> tuple[bytes, int] | None:
            taken = super().take()
            if taken is None:
                self.fillings += 1
                assert self.fillings < 100
                self.append((encode(MESSAGES[PLAN]), 1))
            return taken

    sources = {topic: Flood() if topic is PLAN else FakeStream() for topic in RECORDED}
    assert Receiver(sources, 6, lambda *_: None).take()[PLAN]
