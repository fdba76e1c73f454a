"""The numbers of docs/imitation.md, in docs/imitation.json."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from experiments.imitation.conditions import Adapted, Limited
from experiments.imitation.own import Own

RESULTS = Path(__file__).resolve().parents[2] / "docs" / "imitation.json"

KINDS = {
    "movements": Own,
    "arms": Own,
    "poses": Own,
    "letters": Own,
    "limited": Limited,
    "adapted": Adapted,
}
"""The tables, and the type of their rows."""

Results = dict[str, list[Any]]
"""Rows by table; a table of recordings that were always absent has none."""


def write(results: Results, path: Path = RESULTS) -> None:
    """Write the rows, six significant digits each."""
    tables = []
    for name, rows in results.items():
        lines = [json.dumps({key: _short(value) for key, value in asdict(row).items()}) for row in rows]
        tables.append(f'"{name}": [\n' + ",\n".join(lines) + "\n]")
    path.write_text("{\n" + ",\n".join(tables) + "\n}\n", encoding="utf-8")


def read(path: Path = RESULTS) -> Results:
    """Return the committed rows."""
    tables = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    return {name: [kind(**row) for row in tables.get(name, [])] for name, kind in KINDS.items()}


def _short(value: object) -> object:
    return float(f"{value:.6g}") if isinstance(value, float) else value
