"""Metadata that is in two places of the repository is the same in both."""

import re
from importlib.metadata import version
from pathlib import Path

import protocol

ROOT = Path(__file__).resolve().parents[2]


def test_one_version():
    citation = re.findall(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    assert citation == [protocol.__version__] == [version("volley")]


def test_every_installed_package_is_typed():
    listed = re.search(r"include = \[(\"motion\*\".*?)\]", (ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert listed is not None
    packages = [name for name in re.findall(r"\"(\w+)\*\"", listed[1]) if (ROOT / name).is_dir()]
    assert len(packages) >= 6
    assert [name for name in packages if not (ROOT / name / "py.typed").exists()] == []


def test_the_workflow_runs_the_versions_that_are_claimed():
    claimed = re.findall(r"Python :: (3\.\d+)\"", (ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    matrix = re.search(r"python: \[(.*?)\]", (ROOT / ".github" / "workflows" / "check.yml").read_text(encoding="utf-8"))
    assert matrix is not None
    assert re.findall(r"3\.\d+", matrix[1]) == claimed


def test_pages_link_to_files_that_exist():
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), ROOT / "benchmarks" / "README.md"]
    links = [
        (page, link)
        for page in pages
        for link in re.findall(r"\]\(([^)#:\s]+)[^):]*\)", page.read_text(encoding="utf-8"))
    ]
    assert len(links) > 30
    assert [f"{page.name}: {link}" for page, link in links if not (page.parent / link).exists()] == []


def test_only_system_tests_need_the_wall_clock():
    """`make test` collects realtime tests from tests/system alone.

    Collecting all folders takes longer than some tests.
    """
    assert "-m realtime tests/system" in (ROOT / "Makefile").read_text(encoding="utf-8")
    marked = [file for file in (ROOT / "tests").rglob("*.py") if re.search(r"mark\.realtime", file.read_text("utf-8"))]
    assert marked
    assert [file for file in marked if file.parent != ROOT / "tests" / "system"] == []
