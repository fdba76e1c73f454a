"""The page docs/imitation.md: its tables and the numbers in its sentences."""

import re
from itertools import groupby
from pathlib import Path

from experiments.imitation.conditions import Adapted, Limited
from experiments.imitation.own import SEEDS, Own
from experiments.imitation.results import KINDS, Results

PAGE = Path(__file__).resolve().parents[2] / "docs" / "imitation.md"

_FACT = re.compile(r"<!--= (\S+) -->.*?<!---->")
_TABLE = re.compile(r"(<!-- table: (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)

ABSENT = "Not measured: the recordings were absent when this page was made."


def quote(page: str, results: Results) -> str:
    """Return the page with its tables and numbers made from the results.

    `<!--= NAME -->…<!---->` holds one of the `facts`, `<!-- table: NAME -->` to `<!-- end -->` a table. Raises KeyError
    for an unknown name.
    """
    known, tables = facts(results), {name: _table(name, rows) for name, rows in results.items()}
    page = _FACT.sub(lambda found: f"<!--= {found[1]} -->{known[found[1]]}<!---->", page)
    return _TABLE.sub(lambda found: found[1] + "\n".join(tables[found[2]]) + "\n" + found[3], page)


def facts(results: Results) -> dict[str, str]:
    """Return the numbers that sentences quote, by name."""
    known = {"seeds": str(SEEDS)}
    for name, kind in KINDS.items():
        if kind is Own:
            known |= {f"{name}.{fact}": value for fact, value in _summary(results[name]).items()}
    for row in results["limited"]:
        known[f"limited.{row.ratio:g}.{row.places}"] = _milli(row.deviation)
    for row in results["adapted"]:
        slug = f"adapted.{row.name.split(',')[0].replace(' ', '_')}.{row.place_time}"
        known[f"{slug}.middle"], known[f"{slug}.largest"] = _digits(row.middle), _digits(row.largest)
        known[f"{slug}.peak"] = _digits(row.peak)
    return known


def _summary(rows: list[Own]) -> dict[str, str]:
    if not rows:
        return dict.fromkeys(("count", "kept", "missed", "largest", "of_bound", "retimed", "acceleration"), "–")
    kept = sum(row.kept for row in rows)
    return {
        "count": str(len(rows)),
        "kept": str(kept),
        "missed": str(len(rows) - kept),
        "largest": _milli(max(row.deviation for row in rows)),
        "of_bound": _digits(100 * max(row.deviation / row.bound for row in rows)),
        "retimed": _digits(100 * max((row.retimed or 0.0) / row.bound for row in rows)),
        "acceleration": _digits(100 * max(row.acceleration_error / row.signal for row in rows)),
    }


def _table(name: str, rows: list) -> list[str]:
    if not rows:
        return [ABSENT]
    if isinstance(rows[0], Limited):
        return _limited(rows)
    if isinstance(rows[0], Adapted):
        return _adapted(rows)
    return _movements(rows) if name == "movements" else _recordings(rows)


def _movements(rows: list[Own]) -> list[str]:
    head = "movement, recorded | functions | deviation, mrad | % of range | bound, mrad | kept"
    cells = [[f"{row.name}, {row.joint}", *_deviation(row), _accelerations(row)] for row in rows]
    return _markdown(f"{head} | acceleration error, rad/s² (% of rms)", cells)


def _recordings(rows: list[Own]) -> list[str]:
    head = "recording, joint | range | functions | deviation | % of range | bound | kept"
    cells = [
        [
            f"{row.name}, {row.joint}",
            _milli(row.range),
            *_deviation(row),
            _milli(row.retimed or 0.0),
            _accelerations(row),
        ]
        for row in rows
    ]
    return _markdown(f"{head} | retimed | acceleration error, 1/s² (% of rms)", cells)


def _deviation(row: Own) -> list[str]:
    kept = "yes" if row.kept else "**no**"
    return [
        str(row.functions),
        _milli(row.deviation),
        _digits(100 * row.deviation / row.range),
        _milli(row.bound),
        kept,
    ]


def _accelerations(row: Own) -> str:
    return f"{_digits(row.acceleration_error)} ({_digits(100 * row.acceleration_error / row.signal)})"


def _limited(rows: list[Limited]) -> list[str]:
    cells = []
    for ratio, group in groupby(rows, lambda row: row.ratio):
        pairs = [f"{_milli(row.deviation)} ({_digits(row.acceleration_error)})" for row in group]
        cells.append([f"{ratio:g}", *pairs])
    return _markdown("limit ÷ peak | without a place term | as planned | `place_time` 0.25 s", cells)


def _adapted(rows: list[Adapted]) -> list[str]:
    cells = []
    for name, group in groupby(rows, lambda row: row.name):
        for number, row in enumerate(group):
            numbers = (row.largest, row.middle, row.acceleration_error, row.peak)
            cells.append(["" if number else name, row.place_time, *map(_digits, numbers)])
    head = "movement | `place_time`, s | largest, rad | in the middle, rad"
    return _markdown(f"{head} | acceleration error, rad/s² | peak acceleration, rad/s²", cells, texts=2)


def _markdown(head: str, cells: list[list[str]], texts: int = 1) -> list[str]:
    columns = head.count(" | ") + 1
    rule = "|" + "---|" * texts + "---:|" * (columns - texts)
    return [f"| {head} |", rule, *(f"| {' | '.join(row)} |" for row in cells)]


def _milli(value: float) -> str:
    return _digits(1e3 * value)


def _digits(value: float) -> str:
    """Return a number with two significant digits, three from 100 on; values below 1e-4 as 0."""
    if value < 1e-4:
        return "0"
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}"
