"""Mutations of valid messages, reproducible from a seed."""

import random
from collections.abc import Callable
from typing import Any

import msgpack

WRONG: tuple[Any, ...] = (
    None,
    True,
    -1,
    0,
    2**63,
    -(2**63),
    1e308,
    -1e308,
    1e-320,
    float("nan"),
    float("inf"),
    "",
    "x" * 5000,
    "\u0000*/$",
    b"\xff" * 48,
    [],
    {},
    [[[[[[[[[[1.0]]]]]]]]]],
    {"a": {"a": {"a": {"a": {"a": {"a": {"a": {"a": {"a": 1}}}}}}}}},
)


def mutate(body: dict[str, Any], rng: random.Random) -> bytes:
    """Return `body` as msgpack with a random mutation; some mutants are still valid messages."""
    return rng.choice(MUTATIONS)(body, rng)


def pack(body: object) -> bytes:
    """Return `body` as msgpack."""
    return msgpack.packb(body) or b""


def _flip(body: dict[str, Any], rng: random.Random) -> bytes:
    data = bytearray(pack(body))
    for _ in range(rng.randint(1, 8)):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(data)


def _truncate(body: dict[str, Any], rng: random.Random) -> bytes:
    data = pack(body)
    return data[: rng.randrange(len(data))]


def _insert(body: dict[str, Any], rng: random.Random) -> bytes:
    data, at = pack(body), rng.randrange(len(pack(body)))
    return data[:at] + rng.randbytes(rng.randint(1, 16)) + data[at:]


def _random(_: dict[str, Any], rng: random.Random) -> bytes:
    return rng.randbytes(rng.choice((0, 1, 7, 100, 5000)))


def _wrong_value(body: dict[str, Any], rng: random.Random) -> bytes:
    """Replace a field, or a value inside it, by a wrong value."""
    if not body:
        return pack({rng.choice(("version", "name")): rng.choice(WRONG)})
    name = rng.choice(list(body))
    return pack({**body, name: _spoil(body[name], rng)})


def _spoil(value: Any, rng: random.Random) -> Any:
    if isinstance(value, dict) and value and rng.random() < 0.75:
        name = rng.choice(list(value))
        return {**value, name: _spoil(value[name], rng)}
    if isinstance(value, list) and value and rng.random() < 0.5:
        at = rng.randrange(len(value))
        return [*value[:at], _spoil(value[at], rng), *value[at + 1 :]]
    return rng.choice(WRONG)


def _wrong_fields(body: dict[str, Any], rng: random.Random) -> bytes:
    """Leave a field out, add one, or send another version."""
    changed = dict(body)
    kind = rng.randrange(3)
    if kind == 0 and changed:
        del changed[rng.choice(list(changed))]
    elif kind == 1:
        changed[rng.choice(("colour", "positions ", "\u0000", "x" * 200))] = rng.choice(WRONG)
    else:
        changed["version"] = rng.choice((0, 2, -1, 1.0, "1", None))
    return pack(changed)


def _double(body: dict[str, Any], rng: random.Random) -> bytes:
    """Send a field twice, the second time wrong."""
    items = list(body.items()) or [("version", 1)]
    name = rng.choice(items)[0]
    items.append((name, rng.choice(WRONG)))
    return bytes([0xDE, 0, len(items)]) + b"".join(pack(name) + pack(value) for name, value in items)


MUTATIONS: tuple[Callable[[dict[str, Any], random.Random], bytes], ...] = (
    _flip,
    _truncate,
    _insert,
    _random,
    _wrong_value,
    _wrong_value,
    _wrong_fields,
    _double,
)
