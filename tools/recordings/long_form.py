"""Tables in long form: a line for each joint and time, with a column that names the joint."""

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from tools.recordings.clock import clock_of
from tools.recordings.names import JOINT, is_no_angle, is_other, scale_of, words

KEYS = JOINT | {"name", "names", "variable", "id"}
"""Words of a column that names the joint; `variable` is the one of pandas.melt."""

MOST = 100
"""Largest number of different texts of a column that names joints."""


@dataclass(slots=True)
class Labels:
    """The texts of a column.

    Attributes:
        line: Line of the first text.
        texts: Code of each text, in the order of appearance; at most MOST + 1 are kept.
        codes: Code of each cell with a text.
    """

    line: int
    texts: dict[str, int] = field(default_factory=dict)
    codes: array = field(default_factory=lambda: array("b"))

    @property
    def first(self) -> str:
        """The first text."""
        return next(iter(self.texts))

    def add(self, text: str) -> None:
        """Add the text of the next cell."""
        if len(self.texts) <= MOST:
            self.texts.setdefault(text, len(self.texts))
        self.codes.append(self.texts.get(text, MOST))


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """Which joint each line of a table is of.

    Attributes:
        joints: Names of the J joints, with the unit of the positions.
        codes: (n,) index of the joint of each line.
        position: Column of the positions.
    """

    joints: tuple[str, ...]
    codes: np.ndarray
    position: int


def is_key(name: str) -> bool:
    """Return whether a column names the joint of each line, by its name."""
    said = words(name)
    return bool(said) and KEYS.issuperset(said)


def find_key(columns: Sequence[str], values: np.ndarray, labels: Mapping[str, Labels]) -> Key | None:
    """Return how a table in long form is read, or None for other tables.

    Such a table has a column that names the joint, by texts or whole numbers, and a single column of positions.

    Args:
        columns: Names of the columns of numbers.
        values: (n, C) numbers.
        labels: Texts of the columns of words, by their names.
    """
    found = [_of_labels(labels[name], len(values)) for name in labels if is_key(name)]
    numbered = [index for index, name in enumerate(columns) if is_key(name)] if not found else []
    found += [_of_numbers(values[:, index]) for index in numbered]
    times = clock_of(columns, values).columns if columns else ()
    rest = [
        index
        for index, name in enumerate(columns)
        if index not in times and index not in numbered and not is_other(name)
    ]
    if len(found) != 1 or found[0] is None or len(rest) != 1:
        return None
    joints, codes = found[0]
    name = columns[rest[0]]
    unit = f" {name}" if scale_of(name) is not None or is_no_angle(name) else ""
    return Key(tuple(joint + unit for joint in joints), codes, rest[0])


def wide(
    times: np.ndarray, positions: np.ndarray, key: Key, rate: float | None
) -> tuple[np.ndarray, tuple[str, ...], np.ndarray]:
    """Return times (m,), the joints' names and values (m, J).

    If all joints have the same times, their numbers are the columns. Otherwise each line is a sample of one joint, with
    NaN for the others.

    Args:
        times: (n,) s, of each line.
        positions: (n,) of each line.
        key: Which joint each line is of.
        rate: Samples of a joint a second, if the times are not those of the file.
    """
    rows = [np.flatnonzero(key.codes == code) for code in range(len(key.joints))]
    first = times[rows[0]] if rate is None else np.arange(len(rows[0])) / rate
    if all(len(each) == len(rows[0]) and (rate is not None or np.array_equal(times[each], first)) for each in rows):
        return first, key.joints, np.column_stack([positions[each] for each in rows])
    values = np.full((len(positions), len(rows)), np.nan)
    values[np.arange(len(positions)), key.codes] = positions
    return times, key.joints, values


def _of_labels(labels: Labels, lines: int) -> tuple[list[str], np.ndarray] | None:
    """Return the joints' names and the index of the joint of each line; None if a line has no name."""
    if not 1 < len(labels.texts) <= MOST or len(labels.codes) < lines:
        return None
    return list(labels.texts), np.array(labels.codes[:lines])


def _of_numbers(column: np.ndarray) -> tuple[list[str], np.ndarray] | None:
    """Return the joints' numbers, in rising order, and the index of the joint of each line; None for other numbers."""
    found, codes = np.unique(column, return_inverse=True)
    if not 1 < len(found) <= MOST or not np.array_equal(found, np.round(found)):
        return None
    return [f"{number:.0f}" for number in found], codes
