"""The table of entities, and the page generated from it."""

from collections import Counter
from pathlib import Path

import pytest

from services.recorder import entities
from services.recorder.entities import ENTITIES, Entity
from tools.pages.trace import page

PAGE = Path(__file__).resolve().parents[3] / "docs" / "trace.md"


def test_page_is_up_to_date() -> None:
    assert PAGE.read_text() == page(), "run: python -m tools.pages.trace > docs/trace.md"


def test_every_entity_of_the_module_is_in_the_table() -> None:
    defined = [value for value in vars(entities).values() if isinstance(value, Entity)]
    for group in vars(entities).values():
        if isinstance(group, dict):
            defined += [value for value in group.values() if isinstance(value, Entity)]
    assert Counter(map(id, defined)) == Counter(map(id, ENTITIES))


def test_paths_are_unique() -> None:
    paths = Counter((entity.path, entity.static) for entity in ENTITIES)
    assert max(paths.values()) == 1


def test_names_replace_the_placeholders_of_a_path() -> None:
    assert entities.SHAPE.at("racket", "box") == "/world/racket/box"
    assert entities.TORQUES.at() == "/arm/torques"
    with pytest.raises(ValueError, match="zip"):
        entities.MEASURED_POSITION.at()
