"""The golden files hold what the codec makes, and every message type with every field has one."""

from typing import cast

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
