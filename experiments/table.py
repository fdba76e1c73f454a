"""The table of all numbers, experiments/results.json, and the page that quotes it, docs/paper.md."""

import json
import re
from collections.abc import Iterable
from pathlib import Path

from experiments.common import Row

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "experiments" / "results.json"
PAGE = ROOT / "docs" / "paper.md"
FIGURES = ROOT / "docs" / "figures"

NOUGHT = 1e-12
"""Smaller absolute values are rounding errors and are written as 0."""

_VALUE = re.compile(r"<!--= (\S+) -->.*?<!---->")
_ROWS = re.compile(r"(<!-- rows: ([^>]*?) -->\n).*?(<!-- end -->)", re.DOTALL)
_SPREAD = ("median", "least", "greatest")


def write_results(rows: Iterable[Row], path: Path = RESULTS) -> None:
    """Write the rows, six significant digits each."""
    lines = []
    for row in rows:
        value = 0.0 if abs(row.value) < NOUGHT else float(f"{row.value:.6g}")
        entry = {"name": row.name, "value": value, "unit": row.unit}
        if row.paper_claim is not None:
            entry["paper_claim"] = row.paper_claim
        lines.append(json.dumps(entry, ensure_ascii=False))
    path.write_text("[\n" + ",\n".join(lines) + "\n]\n", encoding="utf-8")


def read_results(path: Path = RESULTS) -> list[Row]:
    """Return the rows of the committed table."""
    return [Row(**entry) for entry in json.loads(path.read_text(encoding="utf-8"))]


def quote(page: str, rows: Iterable[Row]) -> str:
    """Return the page with every number replaced by that of the table.

    `<!--= NAME -->…<!---->` holds one value, `<!-- rows: PREFIX … -->` to `<!-- end -->` a table of all rows whose
    name begins with one of the prefixes. Raises KeyError for an unknown name.
    """
    by_name = {row.name: row for row in rows}
    page = _VALUE.sub(lambda found: f"<!--= {found[1]} -->{shown(by_name[found[1]].value)}<!---->", page)
    return _ROWS.sub(lambda found: found[1] + "\n".join(as_table(by_name, found[2].split())) + "\n" + found[3], page)


def as_table(by_name: dict[str, Row], prefixes: list[str]) -> list[str]:
    """Return Markdown lines; median, minimum and maximum share a line."""
    lines = ["| | | |", "|---|---:|---|"]
    for prefix in prefixes:
        found = [row for name, row in by_name.items() if name == prefix or name.startswith(f"{prefix}.")]
        if not found:
            raise KeyError(prefix)
        for row in found:
            stem, _, last = row.name.rpartition(".")
            if last == "median":
                median, least, greatest = (shown(by_name[f"{stem}.{word}"].value) for word in _SPREAD)
                lines.append(f"| `{stem}` | {median} ({least} … {greatest}) | {row.unit} |")
            elif last not in _SPREAD:
                lines.append(f"| `{row.name}` | {shown(row.value)} | {row.unit} |")
    return lines


def shown(value: float) -> str:
    """Return a number with three significant digits."""
    if value == 0:
        return "0"
    return f"{value:.3g}" if 1e-3 <= abs(value) < 1e3 else f"{value:.2e}" if abs(value) < 1 else f"{value:.0f}"
