"""The codec reads what it wrote; whatever else arrives is refused in a sentence, never by an exception."""

import math
import random
import types
from collections.abc import Iterator
from typing import Any, Literal, Union, cast, get_args, get_origin, get_type_hints

import msgpack
import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import Struct

from protocol import messages as m
from protocol.codec import MAX_DEPTH, MAX_EXPLAINED, MAX_FIELD, MAX_SENTENCE, decode, encode
from protocol.errors import Refusal
from protocol.topics import MIB, PUBLICATIONS, QUERIES
from tests.golden.examples import EXAMPLES

REQUESTS: list[type[Struct]] = list(dict.fromkeys(query.request for query in QUERIES))
ANSWERS: list[type[Struct]] = [m.ErrorBody, *(query.reply for query in QUERIES), *(p.message for p in PUBLICATIONS)]
KINDS: list[type[Struct]] = list(dict.fromkeys([*REQUESTS, *ANSWERS]))
MODEST = settings(max_examples=60, deadline=None)
NOISE_BYTES = 16 << 20

PLAIN: dict[Any, st.SearchStrategy] = {
    float: st.floats(allow_nan=False, allow_infinity=False),
    int: st.integers(-(2**63), 2**64 - 1),
    str: st.text(max_size=20),
    bool: st.booleans(),
    bytes: st.binary(max_size=32),
    Any: st.none() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=5),
    type(None): st.none(),
}
ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text() | st.binary(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text() | st.binary(), inner, max_size=4),
    max_leaves=12,
)


def values_of(hint: Any) -> st.SearchStrategy:
    """Return a strategy of the values that a type annotation of the messages allows."""
    arguments = get_args(hint)
    match get_origin(hint):
        case None:
            return PLAIN[hint] if hint in PLAIN else messages_of(hint)
        case origin if origin is Literal:
            return st.sampled_from(arguments)
        case origin if origin in (Union, types.UnionType):
            return st.one_of([values_of(argument) for argument in arguments])
        case origin if origin is list:
            return st.lists(values_of(arguments[0]), max_size=3)
        case origin if origin is tuple:
            return st.tuples(*(values_of(argument) for argument in arguments))
    return st.dictionaries(st.text(max_size=5), values_of(arguments[1]), max_size=3)


def messages_of(kind: type[Struct]) -> st.SearchStrategy:
    """Return a strategy of messages of one type."""
    return st.builds(kind, **{name: values_of(hint) for name, hint in get_type_hints(kind).items()})


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield path, container and key of every number in a body."""
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in entries:
        here = f"{path}[{key}]" if isinstance(value, list) else f"{path}.{key}" if path else str(key)
        if isinstance(item, float):
            yield here, value, key
        yield from leaves(item, here)


def plain_body(message: Struct) -> Any:
    """Return the body of a message as Python's own lists and dictionaries."""
    return msgpack.unpackb(encode(message))


def packed(body: Any) -> bytes:
    """Return the body as msgpack, whether or not it is a message."""
    return cast(bytes, msgpack.packb(body))


def check_answer(data: bytes, kind: type[Struct]) -> None:
    """Check that decoding gives a message of the right type, or a short refusal in a sentence."""
    try:
        assert isinstance(decode(data, kind, NOISE_BYTES), kind)
    except Refusal as refusal:
        assert refusal.code == "bad_message"
        assert 10 < len(refusal.message) <= MAX_SENTENCE
        assert len(refusal.detail["field"]) <= MAX_FIELD


@given(st.sampled_from(KINDS).flatmap(messages_of))
@MODEST
def test_round_trip(message):
    assert decode(encode(message), type(message)) == message


@given(st.sampled_from(list(EXAMPLES.values())), st.data())
@MODEST
def test_flipped_bits(message, data):
    body = bytearray(encode(message))
    for bit in data.draw(st.lists(st.integers(0, 8 * len(body) - 1), min_size=1, max_size=4)):
        body[bit // 8] ^= 1 << bit % 8
    check_answer(bytes(body), type(message))


@given(st.sampled_from(list(EXAMPLES.values())), st.data())
@MODEST
def test_truncated_bodies_are_refused(message, data):
    body = encode(message)
    with pytest.raises(Refusal, match="not msgpack"):
        decode(body[: data.draw(st.integers(0, len(body) - 1))], type(message))


@given(st.sampled_from(list(EXAMPLES.values())), st.binary(min_size=1, max_size=20))
@MODEST
def test_trailing_bytes_are_refused(message, extra):
    with pytest.raises(Refusal, match=rf"{len(extra)} bytes follow the message"):
        decode(encode(message) + extra, type(message))


@given(st.sampled_from(KINDS), st.binary(max_size=200))
@MODEST
def test_random_bytes(kind, data):
    check_answer(data, kind)


@given(st.sampled_from(list(EXAMPLES.values())), st.data())
@MODEST
def test_any_value_in_any_field(message, data):
    body = plain_body(message)
    body[data.draw(st.sampled_from(sorted(body)))] = data.draw(ANYTHING)
    check_answer(packed(body), type(message))


@given(st.sampled_from(KINDS), ANYTHING)
@MODEST
def test_any_body(kind, body):
    check_answer(packed(body), kind)


NUMERIC = [
    message
    for message in EXAMPLES.values()
    if list(leaves(plain_body(message))) and not isinstance(message, m.ErrorBody)
]


@given(st.sampled_from(NUMERIC), st.sampled_from([math.nan, math.inf, -math.inf]), st.data())
@MODEST
def test_numbers_that_are_not_finite_are_refused_by_path(message, number, data):
    body = plain_body(message)
    path, container, key = data.draw(st.sampled_from(list(leaves(body))))
    container[key] = number
    with pytest.raises(Refusal) as refused:
        decode(packed(body), type(message))
    assert refused.value.message == f"{path} is {number}; it must be finite"
    assert refused.value.detail == {"field": path}


@given(st.integers(MAX_DEPTH + 1, 100_000), st.sampled_from([b"\x91", b"\x81\xa1a"]))
@MODEST
def test_nesting_bombs_are_refused(depth, opening):
    body = b"\x81\xa9primitive" + opening * depth + b"\x00"
    sentence = r"nested (more than|too deep)" if len(body) <= MAX_EXPLAINED else "primitive: expected str"
    with pytest.raises(Refusal, match=sentence):
        decode(body, m.Goal, MIB)


@given(st.text(min_size=1, max_size=300).filter(lambda name: not name.isidentifier()), st.sampled_from(KINDS))
@MODEST
def test_unknown_fields_are_refused_in_requests_and_ignored_elsewhere(name, kind):
    example = next(message for message in EXAMPLES.values() if type(message) is kind)
    data = packed(plain_body(example) | {name: 1.5})
    if kind in REQUESTS:
        with pytest.raises(Refusal) as refused:
            decode(data, kind)
        assert "known field" in refused.value.message or name in refused.value.message
    else:
        assert decode(data, kind) == example


@pytest.mark.parametrize("path", ["start", "waypoints", "limits", "smoothing", "ball"])
def test_unknown_fields_are_refused_in_parts_of_requests(path):
    requests = [message for message in EXAMPLES.values() if type(message) in REQUESTS]
    message = next(r for r in requests if isinstance(getattr(r, path, None), Struct | list))
    body = plain_body(message)
    part = body[path][0] if isinstance(body[path], list) else body[path]
    part["colour"] = "red"
    with pytest.raises(Refusal, match=r"colour is not a known field") as refused:
        decode(packed(body), type(message))
    assert refused.value.detail["field"].startswith(path)


@pytest.mark.parametrize("opening", [b"", b"\xdf\x00\x10\x00\x00", b"\xdd\x00\xff\xff\xf0", b"\xc6\x00\xff\xff\xfb"])
def test_noise_of_16_mib(opening):
    noise = random.Random(0).randbytes(NOISE_BYTES - len(opening))
    check_answer(opening + noise, m.Learn)


def test_oversize_is_refused_before_it_is_read():
    with pytest.raises(Refusal, match="has 1048577 bytes; at most 1048576"):
        decode(bytes(MIB + 1), m.Goal, MIB)


def test_required_fields_are_named():
    for kind in REQUESTS:
        for field in msgspec.structs.fields(kind):
            if field.required:
                body = plain_body(next(message for message in EXAMPLES.values() if type(message) is kind))
                del body[field.name]
                with pytest.raises(Refusal, match=f"^{field.name} is missing$"):
                    decode(packed(body), kind)
