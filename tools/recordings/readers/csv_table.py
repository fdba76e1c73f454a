"""Text tables with a line for each sample: columns by name or in order, times in s, ms, µs or ns."""

import csv
import math
import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from motion.listing import listed
from tools.recordings.cells import encoding_of, number_of
from tools.recordings.clock import Clock, clock_of, seconds
from tools.recordings.joints import NAMED
from tools.recordings.long_form import Labels, find_key, is_key, wide
from tools.recordings.recording import MAX_SAMPLES, Episode, Recording, Unreadable, head

MAX_BYTES = 256 * 2**20
"""Largest file that is read, which takes about a minute."""

COMMENTS = "#", "//", "sep="
"""Beginnings of lines without samples; `sep=` is how spreadsheets name the delimiter."""
QUOTED_COMMA = re.compile(r'"[+-]?\d*,\d+"')
DELIMITERS = ",", ";", "\t", "|"
NEEDED = "a recording has a line for each sample: a time, then the joints"
CUT_NUMBER = re.compile(r"[+-]?[\d.,]+[eE][+-]?")
"""A number that was cut off within its exponent."""
TEXT_SHARE = 0.5
"""Fraction of text cells above which a column contains words."""


def episodes(path: Path, rate: float | None) -> list[Episode]:
    """Return the single movement of a table."""
    recording = read(path, path.stem, rate)
    times = recording.times
    return [Episode(path.stem, len(times), float(times[-1] - times[0]) if len(times) else None)]


def read(path: Path, episode: str, rate: float | None) -> Recording:
    """Return the columns of numbers as a recording."""
    table = _parse(path)
    if rate is None and _has_time_columns(table.columns):
        return _with_time_columns(path, table, episode)
    key = find_key(table.columns, table.values, table.labels)
    clock = clock_of(table.columns, table.values) if rate is None else Clock(())
    if rate is None and not clock.columns:
        among = f" among {listed(table.columns, NAMED)}" if table.columns else ""
        raise Unreadable(
            f"{path} has no column of times{among}; name it time or t_ms, or give --rate, in samples a second"
        )
    rest = [index for index in range(table.values.shape[1]) if index not in clock.columns]
    if not rest:
        raise Unreadable(f"{path} has times and no joint positions; a line needs one number a joint")
    columns = tuple(table.columns[index] for index in rest) if table.columns else ()
    values = table.values[:, rest]
    times = seconds(table.values, clock) if rate is None else np.arange(len(values)) / rate
    if key is not None:
        times, columns, values = wide(times, table.values[:, key.position], key, rate)
    return Recording(times, columns, values, None, path, episode, rate is None, (*table.notes, *clock.notes))


@dataclass(slots=True)
class _Table:
    columns: tuple[str, ...]
    width: int
    numbers: array = field(default_factory=lambda: array("d"))
    words: dict[int, Labels] = field(default_factory=dict)
    """The texts in each column that has some."""
    notes: list[str] = field(default_factory=list)
    labels: dict[str, Labels] = field(default_factory=dict)
    """The texts in each column of words, by its name."""

    @property
    def values(self) -> np.ndarray:
        return np.frombuffer(self.numbers).reshape(-1, self.width)


def _has_time_columns(columns: Sequence[str]) -> bool:
    """Return whether each column of values follows a column of times, as some measurement programs write channels."""
    are_times = [bool(clock_of((name,), np.zeros((1, 1))).columns) for name in columns]
    return len(columns) > 2 and are_times == [True, False] * (len(columns) // 2)


def _with_time_columns(path: Path, table: _Table, episode: str) -> Recording:
    """Return a recording with a sample for each cell, which is NaN in the other columns."""
    stamps, numbers = table.values[:, ::2], table.values[:, 1::2]
    clock = clock_of(table.columns[:1], stamps[:, :1])
    values = np.full((*numbers.shape, numbers.shape[1]), np.nan)
    each = np.arange(numbers.shape[1])
    values[:, each, each] = numbers
    times = (stamps - stamps[0, 0]).reshape(-1) * clock.units[0]
    rows = values.reshape(len(times), -1)
    return Recording(times, table.columns[1::2], rows, None, path, episode, True, (*table.notes, *clock.notes))


def _parse(path: Path) -> _Table:
    """Read the table line by line. Raises Unreadable, which names the line."""
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise Unreadable(
            f"{path} has {size / 2**20:.0f} MiB; text of at most {MAX_BYTES // 2**20} MiB is read: cut it, or save it "
            "with numpy.savez"
        )
    encoding = encoding_of(head(path)) or "utf-8"
    encoding = "utf-8-sig" if encoding == "utf-8" else encoding
    with path.open(encoding=encoding, errors="replace", newline="") as file:
        first = [line for _, line in zip(range(200), file, strict=False)]
        file.seek(0)
        delimiter, comma = _dialect(first)
        table = _Table((), 0)
        for number, cells in _rows(file, delimiter):
            if not table.width:
                table.width = len(_without_empty_end(cells))
                if _numbers_columns(cells, first, delimiter):
                    continue
                if not _is_numbers(cells, comma):
                    table.columns = tuple(cell.strip() for cell in _without_empty_end(cells))
                    continue
                table.columns = _names_in_comment(first, delimiter, len(cells))
            elif table.columns and not table.numbers and _are_words(cells, comma):
                table.columns = tuple(map(" ".join, zip(table.columns, map(str.strip, cells), strict=False)))
                continue
            _append(path, table, number, cells if len(cells) == table.width else _without_empty_end(cells), comma)
    return _finished(path, table)


def _rows(file: Iterator[str], delimiter: str | None) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and cells of each line that is neither empty nor a comment."""
    for number, line in enumerate(file, 1):
        text = line.strip(" \r\n")
        if not text or text.startswith(COMMENTS):
            continue
        cells = next(csv.reader([text], delimiter=delimiter)) if delimiter else text.split()
        yield number, cells


def _without_empty_end(cells: list[str]) -> list[str]:
    """Return the cells of a line without the empty one after a final delimiter."""
    return cells[:-1] if len(cells) > 1 and not cells[-1].strip() else cells


def _dialect(head: Sequence[str]) -> tuple[str | None, bool]:
    """Return the delimiter (None: blanks) and whether numbers have decimal commas."""
    data = [line for line in head if line.strip() and not line.lstrip().startswith(COMMENTS)][:20]
    complete = data[:-1] or data  # the last line of a short file may be cut off
    counts = {mark: min((line.count(mark) for line in complete), default=0) for mark in DELIMITERS}
    for mark in (";", "\t", "|"):
        if counts[mark]:
            return mark, not any("." in line for line in data[1:]) and any("," in line for line in data[1:])
    quoted = not any("." in line for line in data[1:]) and any(QUOTED_COMMA.search(line) for line in data[1:])
    return ("," if counts[","] else None), quoted


def _names_in_comment(head: Sequence[str], delimiter: str | None, width: int) -> tuple[str, ...]:
    """Return the names in the last comment before the numbers, where numpy.savetxt writes them, or ()."""
    found: tuple[str, ...] = ()
    for line in head:
        text = line.strip()
        if text and not text.startswith(COMMENTS):
            break
        cells = [cell.strip() for cell in (text.lstrip("#/ ").split(delimiter) if text else ())]
        if len(cells) == width and not _is_numbers(cells, False):
            found = tuple(cells)
    return found


def _append(path: Path, table: _Table, number: int, cells: list[str], comma: bool) -> None:
    if len(table.numbers) >= MAX_SAMPLES * table.width:
        raise Unreadable(f"{path} has more than {MAX_SAMPLES} samples; cut it or keep every nth line")
    if table.notes:
        raise Unreadable(f"{path}: {table.notes[0]}; correct the line or delete it")
    if len(cells) != table.width:
        # Only the last line may be short, after a program was stopped.
        table.notes.append(f"line {number} has {len(cells)} columns where the first line has {table.width}")
        return
    try:
        table.numbers.extend([float(cell) for cell in cells])
    except ValueError:
        table.numbers.extend([_number(table, index, number, cell, comma) for index, cell in enumerate(cells)])


def _number(table: _Table, column: int, line: int, cell: str, comma: bool) -> float:
    """Return the number in a cell, or NaN for text, which is recorded in the table."""
    number = number_of(cell, comma)
    if number is not None:
        return number
    table.words.setdefault(column, Labels(line)).add(cell.strip().strip('"'))
    return math.nan


def _without_cut_line(table: _Table) -> None:
    """Remove the last line if it ends within a number's exponent."""
    last = table.words.get(table.width - 1)
    if last is None or len(last.codes) != 1 or table.notes or not math.isnan(table.numbers[-1]):
        return
    if CUT_NUMBER.fullmatch(last.first):
        del table.numbers[-table.width :]
        del table.words[table.width - 1]
        table.notes.append(f"line {last.line} ends with {last.first!r}")


def _finished(path: Path, table: _Table) -> _Table:
    """Return the table without columns of text. Raises Unreadable if numbers are missing."""
    _without_cut_line(table)
    if not table.width or not len(table.values):
        raise Unreadable(f"{path} has no line of numbers; {NEEDED}")
    samples = len(table.values)
    text = [column for column, labels in table.words.items() if len(labels.codes) > TEXT_SHARE * samples]
    for column, labels in table.words.items():
        if column not in text:
            name = table.columns[column] if table.columns else f"column {column + 1}"
            what = f"{name} is {labels.first!r}, not a number"
            raise Unreadable(f"{path}, line {labels.line}: {what}; correct the line or delete it")
    if table.notes:
        table.notes = [f"the last line is truncated and was left out ({table.notes[0]})"]
    kept = [column for column in range(table.width) if column not in text]
    if not kept:
        raise Unreadable(f"{path} has words and no numbers; {NEEDED}")
    columns = tuple(table.columns[column] for column in kept) if table.columns else ()
    if columns:
        columns = _named_by_words(path, table, columns, text)
    numbers = array("d", np.ascontiguousarray(table.values[:, kept]).tobytes())
    labels = {table.columns[column]: table.words[column] for column in text} if columns else {}
    return _Table(columns, len(kept), numbers, notes=table.notes, labels=labels)


def _named_by_words(path: Path, table: _Table, kept: tuple[str, ...], text: Sequence[int]) -> tuple[str, ...]:
    """Return the names of the kept columns; a column of positions is renamed by the column with its joint's name.

    `rostopic echo -p` writes into every line the name of a joint as field.name0 and its position as field.position0.
    """
    joints: dict[str, str] = {}
    for column in text:
        name = table.columns[column]
        position = name.replace("name", "position")
        if position != name and position in kept and not (is_key(name) and len(table.words[column].texts) > 1):
            if len(table.words[column].texts) > 1:
                raise Unreadable(f"{path}: {name} names several joints; write a file for each, or read the bag itself")
            joints[position] = table.words[column].first
    return tuple(joints.get(name, name) for name in kept)


def _numbers_columns(cells: Sequence[str], head: Sequence[str], delimiter: str | None) -> bool:
    """Return whether a first line numbers the columns from 0, as pandas numbers columns without names.

    It then has integers and the next line has none. A column without a name, pandas' index, may precede them.
    """
    index = 0 if cells[0].strip() else 1
    if len(cells) < 2 or [cell.strip() for cell in cells[index:]] != [str(k) for k in range(len(cells) - index)]:
        return False
    _, following = [*_rows(iter(head), delimiter), (0, [])][1]
    return len(following) == len(cells) and all("." in cell for cell in following[index:])


def _is_numbers(cells: Sequence[str], comma: bool) -> bool:
    return all(number_of(cell, comma) is not None for cell in cells)


def _are_words(cells: Sequence[str], comma: bool) -> bool:
    """Return whether a line below the names contains further words, for example units, and no number."""
    found = [number_of(cell, comma) for cell in cells]
    return None in found and all(number is None or math.isnan(number) for number in found)
