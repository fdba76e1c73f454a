"""The golden files hold what the codec makes, and every message type with every field has one."""

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
def test_file_is_what_the_codec_makes(stem):
    data = (FOLDER / f"{stem}.msgpack").read_bytes()
    assert encode(EXAMPLES[stem]) == data
    assert decode(data, type(EXAMPLES[stem])) == EXAMPLES[stem]


@pytest.mark.parametrize("path", sorted((FOLDER / "first").glob("*.msgpack")), ids=lambda path: path.stem)
def test_what_the_first_clients_say_and_hear_still_decodes(path):
    """To the same values: what came later has a default."""
    data = path.read_bytes()
    kind = type(EXAMPLES[path.stem])
    stored = msgpack.unpackb(data)
    again = msgpack.unpackb(encode(decode(data, kind)))
    assert {name: again[name] for name in stored} == {
        name: _with_defaults(again[name], stored[name]) for name in stored
    }


def _with_defaults(now: Any, stored: Any) -> Any:
    """`stored` with the fields that only `now` has: those of maps inside maps and lists."""
    if isinstance(now, dict) and isinstance(stored, dict):
        return now | {name: _with_defaults(now.get(name), value) for name, value in stored.items()}
    if isinstance(now, list) and isinstance(stored, list) and len(now) == len(stored):
        return [_with_defaults(*pair) for pair in zip(now, stored, strict=True)]
    return stored


@pytest.mark.parametrize("stem", ["Trajectory", "GoalReply"])
def test_trajectories_have_no_field_that_the_first_clients_do_not_know(stem):
    """They refuse one, in a reply too: pieces are left out where there are none."""
    known = msgpack.unpackb((FOLDER / "first" / "Trajectory.msgpack").read_bytes()).keys()
    body = msgpack.unpackb(encode(EXAMPLES[stem]))
    assert body.get("trajectory", body).keys() == known


def test_no_file_is_left_over():
    assert {path.stem for path in FOLDER.glob("*.msgpack")} == set(EXAMPLES)


def test_stems_name_their_type():
    assert all(stem.split("-")[0] == type(message).__name__ for stem, message in EXAMPLES.items())


@pytest.mark.parametrize("kind", TYPES)
def test_every_field_has_a_value_of_its_own(kind):
    examples = [message for message in EXAMPLES.values() if type(message) is kind]
    assert examples, f"no golden message of type {kind.__name__}"
    for field in msgspec.structs.fields(kind):
        if field.name != "version" and not field.required:
            default = field.default if field.default is not msgspec.NODEFAULT else cast(type, field.default_factory)()
            assert any(getattr(example, field.name) != default for example in examples), field.name
