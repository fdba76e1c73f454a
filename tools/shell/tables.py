"""Tables, cells and lines for people."""

from collections.abc import Iterable, Sequence

from rich import box
from rich.table import Table
from rich.text import Text

UNITS = {"positions": "rad", "velocities": "rad/s", "accelerations": "rad/s²", "jerks": "rad/s³"}


def joint_table(names: Sequence[str], columns: Sequence[tuple[str, Sequence[object]]], title: str = "") -> Table:
    """Return a table with one row a joint; cells as `cell` makes them."""
    made = table(("joint", *(header for header, _ in columns)), title)
    count = len(columns[0][1])
    for index in range(count):
        name = names[index] if len(names) == count else str(index + 1)
        made.add_row(name, *(cell(values[index]) for _, values in columns))
    return made


def by_quantity(values: object, names: Iterable[str] = UNITS) -> list[tuple[str, Sequence[object]]]:
    """Return columns for `joint_table` from the fields of a message, each a quantity of `UNITS`."""
    return [(f"{name} [{UNITS[name]}]", getattr(values, name)) for name in names]


def table(headers: Sequence[str], title: str = "") -> Table:
    """Return an empty table: the first column left-aligned, all further columns right-aligned."""
    made = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, title_justify="left", title_style="bold")
    made.title = title or None
    for index, header in enumerate(headers):  # as Text: rich would parse [rad] in a plain string as a style
        made.add_column(Text(header), justify="right" if index else "left", no_wrap=not index)
    return made


def cell(value: object) -> str:
    """Return a value as one cell: numbers to four digits, ranges as low … high, None as a dash."""
    match value:
        case None:
            return "–"
        case bool():
            return "yes" if value else "no"
        case float():
            return "0" if abs(value) < 1e-9 else f"{value:.0f}" if abs(value) >= 1e4 else f"{value:.4g}"
        case [low, high]:
            return f"{cell(low)} … {cell(high)}"
    return str(value)


def sentence(*parts: str) -> Text:
    """Return a line of the non-empty parts, separated by dots."""
    return Text(" · ".join(part for part in parts if part))
