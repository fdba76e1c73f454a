"""The committed table and page are complete and agree; today's experiments give their numbers."""

import math
from collections.abc import Callable

import pytest

pytest.importorskip("matplotlib", reason="the extra `paper` is not installed")
pytest.importorskip("cvxopt", reason="the extra `paper` is not installed")

from experiments import fig6, table
from experiments.__main__ import EXPERIMENTS
from experiments.common import Outcome, Row

RELATIVE = 0.05
"""Of a value: what another machine's rounding, or a solver's, may change."""

ABSOLUTE = 1e-6

EXTREME = [0, 6, 8, 13, 28, 29, 68, 72, 77, 86, 89, 95, 96]
"""Noisy demonstrations of fig. 6: that of the figure, and those with the least or greatest error of a method."""


def test_the_page_quotes_the_table():
    """Every number between the page's marks is the table's."""
    page = table.PAGE.read_text(encoding="utf-8")
    assert page == table.quote(page, table.read_results())
    assert page.count("<!--= ") > 8
    assert page.count("<!-- rows: ") > 5


def test_quoting_replaces_what_is_stale_and_refuses_what_is_unknown():
    """One value and one table; a spread is one line."""
    rows = [Row("a.median", 1.234567, "m"), Row("a.least", 0.0, "m"), Row("a.greatest", 2e-5, "m"), Row("b", 4e4, "s")]
    page = "x <!--= b -->1<!----> y\n<!-- rows: a b -->\nstale\n<!-- end -->\n"
    quoted = table.quote(page, rows)
    assert "x <!--= b -->40000<!----> y" in quoted
    assert "| `a` | 1.23 (0 … 2.00e-05) | m |\n| `b` | 40000 | s |" in quoted
    assert "stale" not in quoted
    with pytest.raises(KeyError):
        table.quote("<!--= c -->1<!---->", rows)
    with pytest.raises(KeyError):
        table.quote("<!-- rows: c -->\n<!-- end -->", rows)


def test_the_table_survives_writing(tmp_path):
    """Six digits, rounding as 0, claims kept."""
    rows = [Row("a", 1.23456789, "m", "θ"), Row("b", 3e-15, "s")]
    table.write_results(rows, tmp_path / "results.json")
    assert table.read_results(tmp_path / "results.json") == [Row("a", 1.23457, "m", "θ"), Row("b", 0.0, "s")]


def test_every_experiment_is_in_the_table_once():
    """Names are unique; the live part is there too."""
    names = [row.name for row in table.read_results()]
    assert len(names) == len(set(names))
    assert {name.split(".")[0] for name in names} == {*EXPERIMENTS, "live"}


@pytest.mark.parametrize("name", [name for name in EXPERIMENTS if name != "fig6"])
def test_the_experiments_bring_the_committed_numbers(name: str):
    """Each to 5 %, but for times; and each picture exists."""
    check(name, EXPERIMENTS[name](), lambda row: not row.startswith("solver.time"))


def test_fig_6_brings_the_committed_numbers():
    """Only the demonstrations with extreme errors are learned; the medians, which need all hundred, are left out."""
    check("fig6", fig6.run(EXTREME), lambda row: not row.endswith(".median"))


def check(name: str, outcome: Outcome, compared: Callable[[str], bool]) -> None:
    """Check an experiment's picture, its rows, and the values of the rows that are to be compared."""
    committed = {row.name: row for row in table.read_results() if row.name.split(".")[0] == name}
    assert [row.name for row in outcome.rows] == list(committed)
    assert (outcome.figure is None) == (not (table.FIGURES / f"{name}.png").exists())
    for row in outcome.rows:
        known = committed[row.name]
        assert (row.unit, row.paper_claim) == (known.unit, known.paper_claim)
        if compared(row.name):
            assert math.isclose(row.value, known.value, rel_tol=RELATIVE, abs_tol=ABSOLUTE), row.name
