"""`python -m experiments.imitation`: make docs/imitation.md, its numbers and its figures."""

from collections.abc import Callable
from typing import Annotated, Any, Literal, get_args

import tyro
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import track
from tyro.conf import Positional

from benchmarks.learning import PLACES, RECORDERS
from experiments.imitation import conditions, pictures, recorded, results
from experiments.imitation.own import nearest_to_bound, of_recording, synthetic
from experiments.imitation.page import PAGE, quote

FIGURES = PAGE.parent / "figures"

TableName = Literal["movements", "arms", "poses", "letters", "limited", "adapted"]
Made = tuple[list[Any], Figure]
"""Rows of a table, and its figure."""


def movements() -> Made:
    """Make rows of movements in closed form: the worst recording of each recorder."""
    rows = [synthetic(movement, recorder) for movement in track(PLACES, "movements") for recorder in RECORDERS]
    return rows, pictures.movements(PLACES)


def arms() -> Made | None:
    """Make rows of every joint of every recording of an arm; None if the recordings are absent."""
    if not (found := list(recorded.arms())):
        return None
    return [row for recording in track(found, "arms") for row in of_recording(recording)], pictures.arms(found)


def poses() -> Made | None:
    """Make rows of the worst coordinate of every recording of a tool; None if the recordings are absent."""
    if not (found := list(recorded.poses())):
        return None
    return [nearest_to_bound(of_recording(recording)) for recording in track(found, "poses")], pictures.poses(found)


def letters() -> Made | None:
    """Make rows of the worst recording of every letter; None if the package with the recordings is absent."""
    if not (found := list(recorded.letters())):
        return None
    rows = [
        nearest_to_bound([row for recording in letter for row in of_recording(recording, timed=True)])
        for letter in track(found, "letters")
    ]
    return rows, pictures.letters([recordings[0] for recordings in found])


def limited() -> Made:
    """Make rows of a pick and place under speed limits."""
    return list(conditions.limited()), pictures.limited()


def adapted() -> Made:
    """Make rows of movements between other ends."""
    return list(conditions.adapted()), pictures.adapted()


MAKERS: dict[TableName, Callable[[], Made | None]] = {
    "movements": movements,
    "arms": arms,
    "poses": poses,
    "letters": letters,
    "limited": limited,
    "adapted": adapted,
}


def main(
    tables: Positional[tuple[Annotated[TableName, tyro.conf.arg(metavar="TABLE")], ...]] = (),
) -> None:
    """Make tables, by default all of them; other tables, and those whose recordings are absent, keep their rows.

    Args:
        tables: Tables to make.
    """
    console, rows = Console(), results.read()
    for name in tables or get_args(TableName):
        made = MAKERS[name]()
        if made is None:
            console.print(f"{name}: skipped, the recordings are absent; the page keeps what it has of them")
            continue
        rows[name], figure = made
        figure.savefig(FIGURES / f"imitation_{name}.png", metadata={"Software": None})
    results.write(rows)
    PAGE.write_text(quote(PAGE.read_text(encoding="utf-8"), results.read()), encoding="utf-8")
    console.print("numbers in docs/imitation.json, figures in docs/figures, quoted in docs/imitation.md")


if __name__ == "__main__":
    tyro.cli(main)
