"""The codec: refusals that name the field and a remedy, bounds on size and memory, and matrices."""

import contextlib
import gc
import tracemalloc
from typing import Any, cast

import msgpack
import numpy as np
import pytest

from protocol import messages as m
from protocol.codec import check_request_size, decode, encode, matrix, matrix_bytes
from protocol.errors import CODES, Refusal
from protocol.topics import CANCEL, EXECUTE, MIB

GOAL = {"primitive": "forehand", "positions": [0.5, 1.0]}


def refusal(body: Any, kind: type = m.Goal) -> Refusal:
    with pytest.raises(Refusal) as refused:
        decode(cast(bytes, msgpack.packb(body)), kind)
    assert refused.value.code == "bad_message"
    return refused.value


@pytest.mark.parametrize(
    ("change", "field", "sentence"),
    [
        ({"positions": [0.5, "one"]}, "positions[1]", "positions[1]: expected float, got str"),
        ({"lease": 1}, "lease", "lease: expected bool, got int"),
        ({"lease": None}, "lease", "lease: expected bool, got null"),
        ({"duration": True}, "duration", "duration: expected float | null, got bool"),
        ({"start": [1.0]}, "start", "start: expected map | null, got array"),
        ({"tail": "fly"}, "tail", "tail: invalid enum value 'fly'; choose from 'stop', 'coast'"),
        ({"version": 2}, "version", "version: invalid enum value 2; choose from 1"),
        ({"start": {}}, "start.positions", "start.positions is missing"),
        ({"limits": {"colour": 1}}, "limits.colour", "limits.colour is not a known field"),
        ({b"lease": True}, "", "the body has the key b'lease'; keys are strings"),
        ({1: True}, "", "the body has the key 1; keys are strings"),
        ({(1, 2): True}, "", "the body has a list or a map for a key; keys are strings"),
        ({"limits": {1: 2}}, "limits", "limits has the key 1; keys are strings"),
        (
            {"limits": {"positions": [[0.0, 1.0, 2.0]]}},
            "limits.positions[0]",
            "limits.positions[0]: expected array of length 2, got 3",
        ),
    ],
)
def test_a_malformed_body_is_refused_with_its_field(change, field, sentence):
    refused = refusal(GOAL | change)
    assert (refused.message, refused.detail) == (sentence, {"field": field})


@pytest.mark.parametrize(
    ("body", "kind", "sentence"),
    [
        ({"goal_id": "g" * 5000, "stamps": {b"planned": 2}}, m.Trajectory, "stamps has a key that is not a string"),
        ({b"version": 1, "goal_id": "g" * 5000}, m.Trajectory, "the body has a key that is not a string"),
        ({"lead": 0.1, "a` - at `key` in `$.lead": 1}, m.ReferenceRequest, "lead has a key that is not a string"),
        ({"positions": [1.0], "a` - at `key` in `$.positions[0]": 1}, m.Goal, "positions[0] has a key that is no"),
    ],
    ids=["large", "large itself", "deceptive", "deceptive in a list"],
)
def test_an_invalid_key_is_refused_without_being_named(body: dict[Any, Any], kind: type, sentence: str):
    """If the body is too large to be searched, or if a field's name imitates msgspec's error message."""
    with pytest.raises(Refusal) as refused:
        decode(cast(bytes, msgpack.packb(body)), kind, EXECUTE.max_bytes)
    assert refused.value.message.startswith(sentence)


def test_a_body_may_be_the_map_of_joints_itself():
    """`hold` takes {joint: value} too; what does not fit is refused like any other body."""
    for body in ({"joints": {"finger": 0.5}}, {"finger": 0.5}, {"version": 1, "finger": 0.5}):
        assert decode(cast(bytes, msgpack.packb(body)), m.Hold) == m.Hold(joints={"finger": 0.5})
    for body, field in (({}, "joints"), ({"version": 1}, "joints"), ({"finger": "open"}, "finger")):
        assert refusal(body, m.Hold).detail["field"] == field
    assert refusal({"finger": float("nan")}, m.Hold).message == "finger is nan; it must be finite"
    assert refusal({"joints": 3}, m.Hold).message == "joints: expected map, got int"


@pytest.mark.parametrize(
    ("body", "kind"),
    [({"finger": "open"}, m.Hold), ({"joints": 3}, m.Hold), ({"lead": "a"}, m.ReferenceRequest), ({"a": 1}, m.Step)],
)
def test_a_refusal_leaves_no_garbage(body: dict[str, Any], kind: type):
    """The loops do not collect cycles, so a refusal that is part of one would stay in memory."""
    data = cast(bytes, msgpack.packb(body))
    with contextlib.suppress(Refusal):
        decode(data, kind)  # builds what all later calls share
    gc.collect()
    gc.disable()
    try:
        with contextlib.suppress(Refusal):
            decode(data, kind)
        assert gc.collect() == 0
    finally:
        gc.enable()


def test_an_unknown_field_is_refused_with_a_list_of_the_known_ones():
    assert "; Step has version, ticks" in refusal({"ticks": 1, "tocks": 2}, m.Step).message


@pytest.mark.parametrize("body", [123, [GOAL], "goal", None, 1.5])
def test_a_body_that_is_not_a_map_is_refused(body):
    assert refusal(body).message.endswith("send a msgpack map with string keys")


@pytest.mark.parametrize(
    "body", [b'{"primitive": "forehand"}', b' \n{"a": 1}', b"{}", b"[1, 2]", b'{"long": "' + b"x" * 10_000 + b'"}']
)
def test_a_body_in_json_is_recognised(body: bytes):
    with pytest.raises(Refusal) as refused:
        decode(body, m.Goal)
    assert refused.value.message == "the body looks like JSON; send the same as msgpack"


@pytest.mark.parametrize("body", [b"{", b"[", b"{\x80", b"\x80\x80"])
def test_other_bytes_are_not_taken_for_json(body: bytes):
    with pytest.raises(Refusal) as refused:
        decode(body, m.Goal)
    assert "JSON" not in refused.value.message


def test_a_request_that_is_too_large_is_refused_with_its_topics_limit():
    check_request_size(EXECUTE, EXECUTE.max_bytes)
    with pytest.raises(Refusal) as refused:
        check_request_size(EXECUTE, EXECUTE.max_bytes + 1)
    assert refused.value.message == (
        "`execute` takes at most 4194304 bytes, and this body has 4194305; send the motion as `pieces`"
    )
    with pytest.raises(Refusal, match=r"`cancel` takes at most 16384 bytes, and this body has 16385$"):
        check_request_size(CANCEL, 16385)


def test_any_plan_fits_execute_as_pieces():
    """The largest plan: 64 joints, 400 functions, and five pieces of the stop for each joint."""
    count = 400 + 5 * m.MAX_JOINTS
    pieces = m.Pieces(
        breaks=np.linspace(0, 60, count + 1).tolist(),
        coefficients=bytes(8 * count * m.MAX_JOINTS * m.COEFFICIENTS),
    )
    message = m.Trajectory(
        goal_id="g" * 128, client_id="c" * 128, epoch=1 << 40, joint_names=["j" * 64] * m.MAX_JOINTS,
        start_time=1e6 / 3, dt=0.001, count=60_001, hit_index=59_000, pieces=pieces,
    )  # fmt: skip
    assert len(encode(message)) < EXECUTE.max_bytes
    assert decode(encode(message), m.Trajectory, EXECUTE.max_bytes).pieces == pieces


def test_text_is_not_taken_for_a_matrix():
    refused = refusal({"name": "wipe", "positions": "AAAAAAAA8D8=", "joint_count": 1, "rate": 1.0}, m.Learn)
    assert refused.message == "positions: expected bytes | array, got str"


def array(length: int, entry: bytes) -> bytes:
    """Return a msgpack array of `length` equal entries."""
    return b"\xdd" + length.to_bytes(4, "big") + entry * length


@pytest.mark.parametrize(
    ("field", "value", "sentence"),
    [
        ("joint_names", array(4_000_000, b"\x90"), "joint_names: expected array of length <= 64"),
        ("joint_names", array(4_000_000, b"\xa0"), "joint_names: expected array of length <= 64"),
        ("positions", array(4_000_000, b"\x01"), "positions: expected bytes | null, got array"),
        ("pieces", b"\x81\xa6breaks" + array(4_000_000, b"\x01"), "pieces.breaks: expected array of length <= 4097"),
        ("colour", array(4_000_000, b"\x90"), "colour is not a known field"),
        (" - at `$" + ".a" * 2_000_000 + "`", b"\xc0", " - at  is not a known field"),
    ],
    ids=["lists", "texts", "numbers", "breaks", "unknown", "deceptive"],
)
def test_nothing_is_built_of_a_body_of_the_wrong_type(field: str, value: bytes, sentence: str):
    """Building it would delay a 1 kHz loop in the same process."""
    body = b"\x81" + cast(bytes, msgpack.packb(field)) + value
    tracemalloc.start()
    with pytest.raises(Refusal) as refused:
        decode(body, m.Trajectory, EXECUTE.max_bytes)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert refused.value.message.startswith(sentence)
    assert peak < 5 * len(field) + 200_000


def test_a_number_that_is_not_finite_is_named_in_a_large_body():
    samples = [[0.0, 1.0]] * 10_000 + [[0.0, float("nan")]]
    with pytest.raises(Refusal) as refused:
        decode(cast(bytes, msgpack.packb({"name": "wipe", "positions": samples, "rate": 100.0})), m.Learn, 16 * MIB)
    assert refused.value.message == "positions[10000][1] is not finite; it must be finite"


def test_a_refusal_is_short_for_any_body():
    refused = refusal(GOAL | {"x" * 500_000: 1})
    assert len(refused.message) <= 400
    assert len(refused.detail["field"]) <= 120


def test_the_version_is_optional_and_integers_are_accepted_as_numbers():
    goal = decode(cast(bytes, msgpack.packb({"primitive": "forehand", "positions": [1, 2]})), m.Goal)
    assert goal == m.Goal(primitive="forehand", positions=[1.0, 2.0])


def test_null_fields_are_encoded():
    assert msgpack.unpackb(encode(m.Cancel())) == {"version": 1, "goal_id": None}


def test_matrix_round_trip():
    values = np.arange(6.0).reshape(3, 2)
    assert np.array_equal(matrix(matrix_bytes(values), 3, 2, "positions"), values)
    assert np.array_equal(matrix(matrix_bytes(np.asfortranarray(values)), 3, 2, "positions"), values)


@pytest.mark.parametrize(("rows", "columns"), [(3, 3), (2, 2), (-1, -6), (6, 0), (0, 0)])
def test_a_matrix_of_the_wrong_size_is_refused(rows, columns):
    with pytest.raises(Refusal, match="positions has 48 bytes; it must be"):
        matrix(bytes(48), rows, columns, "positions")


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_a_matrix_with_a_number_that_is_not_finite_is_refused(number):
    values = np.zeros((3, 2))
    values[1, 0] = number
    with pytest.raises(Refusal) as refused:
        matrix(matrix_bytes(values), 3, 2, "velocities")
    assert refused.value.message == f"velocities[1][0] is {number}; it must be finite"


def test_a_refusal_needs_the_details_of_its_code():
    with pytest.raises(TypeError, match=r"\['bound', 'value'\]"):
        Refusal("limit", "too far", joint="joint_1", quantity="positions")
    with pytest.raises(KeyError):
        Refusal("no_such_code", "?")
    assert all(Refusal(code, "…", **dict.fromkeys(CODES[code])).code == code for code in CODES)
