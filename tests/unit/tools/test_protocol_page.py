"""docs/protocol.md is current and complete, and its links are valid."""

import inspect
import re
from pathlib import Path

import msgspec

from protocol import messages as m
from protocol.errors import CODES
from protocol.topics import PUBLICATIONS, QUERIES
from tools.pages.protocol import MEANINGS, page

PAGE = Path(__file__).resolve().parents[3] / "docs" / "protocol.md"


def test_page_is_up_to_date():
    assert PAGE.read_text() == page(), "run: python -m tools.pages.protocol > docs/protocol.md"


def test_every_message_has_one_table():
    headings = re.findall(r"^#### (\w+)$", page(), re.MULTILINE)
    bases = {m.Message, m.Request, m.Motion}
    messages = {kind for kind in vars(m).values() if isinstance(kind, type) and issubclass(kind, msgspec.Struct)}
    assert sorted(headings) == sorted(kind.__name__ for kind in messages - bases - {msgspec.Struct})


def test_every_key_has_its_section():
    text = page()
    assert all(f"### Request `{query.key}`\n" in text for query in QUERIES)
    assert all(f"### Publication `{publication.key}`\n" in text for publication in PUBLICATIONS)


def test_links_lead_to_headings():
    text = page()
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    anchors = [re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings]
    assert set(re.findall(r"\(#([^)]*)\)", text)) <= set(anchors)
    assert len(anchors) == len(set(anchors)), "two headings with the same anchor"


def test_docstrings_describe_exactly_the_fields_of_their_message():
    for kind in vars(m).values():
        if isinstance(kind, type) and issubclass(kind, msgspec.Struct) and "Attributes:" in (kind.__doc__ or ""):
            described = re.findall(r"^ {4}(\w+): ", inspect.cleandoc(kind.__doc__ or ""), re.MULTILINE)
            inherited = getattr(kind.__base__, "__struct_fields__", ())
            assert set(described) == set(kind.__struct_fields__) - set(inherited), kind.__name__


def test_every_code_is_explained():
    assert MEANINGS.keys() == CODES.keys()
