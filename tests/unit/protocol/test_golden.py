"""Golden files agree with the codec and cover every field of every message type."""

from typing import Any, cast

import msgpack
import msgspec
import pytest

from protocol import messages as m
from protocol.codec import decode, encode
from protocol.topics import PUBLICATIONS, QUERIES
from tests.golden.examples import EXAMPLES
from tests.golden.make import FOLDER

TYPES: list[type[msgspec.Struct]] = [
    m.ErrorBody,
    *(query.request for query in QUERIES),
    *(query.reply for query in QUERIES),
    *(publication.message for publication in PUBLICATIONS),
]


@pytest.mark.parametrize("stem", EXAMPLES)
def test_a_golden_file_is_the_encoded_example(stem):
    data = (FOLDER / f"{stem}.msgpack").read_bytes()
    assert encode(EXAMPLES[stem]) == data
    assert decode(data, type(EXAMPLES[stem])) == EXAMPLES[stem]


@pytest.mark.parametrize("path", sorted((FOLDER / "first").glob("*.msgpack")), ids=lambda path: path.stem)
def test_messages_of_the_first_version_still_decode(path):
    """To the same values; later fields have defaults."""
    data = path.read_bytes()
    kind = type(EXAMPLES[path.stem])
    stored = msgpack.unpackb(data)
    again = msgpack.unpackb(encode(decode(data, kind)))
    assert {name: again[name] for name in stored} == {
        name: _with_defaults(again[name], stored[name]) for name in stored
    }


def _with_defaults(now: Any, stored: Any) -> Any:
    """Return `stored` with the fields that only `now` has, also in nested maps and lists."""
    if isinstance(now, dict) and isinstance(stored, dict):
        return now | {name: _with_defaults(now.get(name), value) for name, value in stored.items()}
    if isinstance(now, list) and isinstance(stored, list) and len(now) == len(stored):
        return [_with_defaults(*pair) for pair in zip(now, stored, strict=True)]
    return stored


@pytest.mark.parametrize("stem", ["Trajectory", "GoalReply"])
def test_trajectories_without_pieces_have_only_fields_of_the_first_version(stem):
    """Clients of the first version refuse unknown fields."""
    known = msgpack.unpackb((FOLDER / "first" / "Trajectory.msgpack").read_bytes()).keys()
    body = msgpack.unpackb(encode(EXAMPLES[stem]))
    assert body.get("trajectory", body).keys() == known


def test_every_golden_file_has_an_example():
    assert {path.stem for path in FOLDER.glob("*.msgpack")} == set(EXAMPLES)


def test_names_of_examples_begin_with_their_type():
    assert all(stem.split("-")[0] == type(message).__name__ for stem, message in EXAMPLES.items())


@pytest.mark.parametrize("kind", TYPES)
def test_every_field_has_an_example_other_than_its_default(kind):
    examples = [message for message in EXAMPLES.values() if type(message) is kind]
    assert examples, f"no golden message of type {kind.__name__}"
    for field in msgspec.structs.fields(kind):
        if field.name != "version" and not field.required:
            default = field.default if field.default is not msgspec.NODEFAULT else cast(type, field.default_factory)()
            assert any(getattr(example, field.name) != default for example in examples), field.name
