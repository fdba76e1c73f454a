"""The drill's result file, and the page generated from it."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from tools.drill.report import BEGIN, END, markdown, save, value_text, write_markdown
from tools.drill.scenario import evaluate
from tools.drill.table import FAMILIES, SCENARIOS, select

DOCS = Path(__file__).resolve().parents[3] / "docs"
PAGE = DOCS / "reliability.md"


def measured(name: str, good: bool) -> dict[str, float | str]:
    """Return a measurement for every bound of a scenario, each exactly at the bound, or else invalid."""
    return {bound.reaction: bound.value if good else "nothing" for bound in SCENARIOS[name].bounds}


def test_numbers_are_formatted_with_units():
    """Integers and words are unchanged, other numbers have three significant digits."""
    assert [value_text(20, "ms"), value_text(0.012345, "s"), value_text("busy"), value_text(None)] == [
        "20 ms",
        "0.0123 s",
        "busy",
        "not measured",
    ]


def test_later_results_are_merged_into_the_file(tmp_path: Path):
    """A repeated scenario replaces its row; the others stay."""
    file = tmp_path / "drill.json"
    one, other = SCENARIOS["push"], SCENARIOS["cancel"]
    save(file, [evaluate(one, measured("push", True), 1.0), evaluate(other, measured("cancel", True), 1.0)])
    document = save(file, [evaluate(one, measured("push", False), 2.0)])
    assert json.loads(file.read_text()) == document
    assert {name: row["held"] for name, row in document["rows"].items()} == {"push": False, "cancel": True}
    text = markdown(document)
    assert text.count("**failed**") == 1
    assert text.count("not measured") == len(SCENARIOS) - 2


def test_reasons_of_earlier_attempts_are_shown(tmp_path: Path):
    before = "why the first was repeated", "why the second was"
    outcome = replace(evaluate(SCENARIOS["noise"], measured("noise", True), 1.0), earlier_attempts=before)
    text = markdown(save(tmp_path / "drill.json", [outcome]))
    assert "<br>repeated: why the first was repeated<br>repeated: why the second was | " in text


def test_only_the_table_of_a_page_is_replaced(tmp_path: Path):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}\noutdated\n{END}\nafter\n")
    write_markdown(page, {"machine": {"cores": "2"}, "rows": {}})
    text = page.read_text()
    assert text.startswith("before\n")
    assert text.endswith("\nafter\n")
    assert "outdated" not in text
    assert "cores 2" in text


def test_the_page_is_generated_from_the_saved_measurements():
    document = json.loads(PAGE.with_suffix(".json").read_text())
    assert f"{BEGIN}\n\n{markdown(document)}\n{END}" in PAGE.read_text()


def test_the_page_has_every_scenario_with_its_present_fault():
    lines = PAGE.read_text().splitlines()
    rows = [line for line in lines if line.startswith("| `")]
    assert [row.split("`")[1] for row in rows] == list(SCENARIOS)
    for row, scenario in zip(rows, SCENARIOS.values(), strict=True):
        assert scenario.fault in row


def test_the_measurements_that_operations_explains_exist():
    """Every name in the first column of the page's table is a measurement of a scenario, or `error`."""
    _, _, table = (DOCS / "operations.md").read_text().partition("| failed | most likely |\n|---|---|\n")
    rows = table.partition("\n\n")[0].splitlines()
    explained = {name for row in rows for name in re.findall("`(.+?)`", row.split("|")[1])}
    assert explained
    assert explained - {"error"} <= {bound.reaction for each in SCENARIOS.values() for bound in each.bounds}


def test_scenarios_are_chosen_by_name():
    """Without a name all are chosen; an unknown one raises an error that lists all names."""
    assert select([]) == [scenario for family in FAMILIES.values() for scenario in family]
    assert [scenario.name for scenario in select(["push", "cancel"])] == ["push", "cancel"]
    with pytest.raises(KeyError, match=r"pull.*push"):
        select(["pull"])
