"""The project's prose uses the field's words: words that used to stand for them are rejected."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

FOLDERS = (
    ".",
    "benchmarks",
    "client",
    "deploy",
    "docs",
    "examples",
    "experiments",
    "motion",
    "protocol",
    "robot",
    "services",
    "tests",
    "tools",
)
"""Folders that are checked, with everything below them; "." stands for the files at the top."""

BETTER = {
    r"hubs?": "router",
    r"way-points?": "waypoint",
    r"h(?:as|ave|ad) to be": "must be",
    r"anew": "again, new",
    r"told": "reported, announced",
    r"heard|hears?": "received, detected",
    r"whoever": "the one that, anybody who",
    r"(?:holds?|held|holding) up": "delay, block",
    r"for want of": "without, because … is missing",
    r"shall": "must, or the present tense",
    r"such a one|one who|that which|none but": "the noun",
    r"\(design \d[\d.]*[a-z]?\)|the design": "a heading of docs/derivations.md",
}
"""Regular expressions of whole words, each with what to write instead; a word in backticks or called is a name."""

EXEMPT = {Path(__file__)}
"""This list."""

PATTERN = re.compile("|".join(rf"(?<![\w`.-])(?:{word})(?![\w`(-])" for word in BETTER), re.IGNORECASE)


def texts(folder: str) -> Iterator[Path]:
    """Yield the Python and Markdown files of a folder, generated ones included."""
    inside = ROOT / folder
    for suffix in (".py", ".md"):
        yield from inside.glob(f"*{suffix}") if folder == "." else inside.rglob(f"*{suffix}")


@pytest.mark.parametrize("folder", FOLDERS)
def test_prose_is_in_the_fields_words(folder: str):
    found = [
        f"{path.relative_to(ROOT)}:{number}: {match[0]!r}"
        for path in texts(folder)
        if path not in EXEMPT
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        for match in PATTERN.finditer(line)
    ]
    assert not found, "\n".join(["write instead:", *(f"  {old}: {new}" for old, new in BETTER.items()), *found])


@pytest.mark.parametrize(
    "sentence",
    ["The hub is told.", "A way-point has to be met.", "see (design 1.5)", "Balls shall land.", "Such a one is late."],
)
def test_the_old_words_are_recognised(sentence: str):
    assert PATTERN.search(sentence)


@pytest.mark.parametrize(
    "sentence",
    ["github.com", "_fault_told = 1", "three-way points", "hold upright", "the bound `told`", "loop.hear(command)"],
)
def test_others_are_not(sentence: str):
    assert not PATTERN.search(sentence)
