"""Text as programs and spreadsheets write it: how it is encoded, and what a cell of a table says."""

import codecs
import math
import re
from datetime import UTC, datetime

BOMS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}

ZEROS = 0.4
"""Part of the bytes of UTF-16 without a mark that are zero, where digits are: half of them, of one parity."""

MISSING = frozenset({"", "na", "n/a", "#n/a", "null", "none", "-", "--"})
"""Cells that say that there is no number."""

FORTRAN = re.compile(r"([+-]?[\d.]+)[dD]([+-]?\d+)")
CLOCK = re.compile(r"(?:\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}[ T]+)?(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)")
"""A time of day, after a date whose order of day and month nobody says."""


def encoding_of(begin: bytes) -> str | None:
    """Return how the first bytes of a text are encoded, None where they are no text.

    Bytes beyond ASCII that are no UTF-8 are taken as Windows-1252, of which Latin-1's letters are a part: digits and
    delimiters are the same in all such encodings, and ° and µ in both of these.
    """
    for mark, name in BOMS.items():
        if begin.startswith(mark):
            return name if _is_plain(begin.decode(name, "ignore")) else None
    even, odd = begin[::2], begin[1::2]
    for zeros, others, name in ((odd, even, "utf-16-le"), (even, odd, "utf-16-be")):
        if zeros.count(0) > 2 * ZEROS * len(zeros) and not others.count(0):
            return name if _is_plain(begin.decode(name, "ignore")) else None
    for name in ("utf-8", "cp1252"):
        try:
            text = begin[: begin.rfind(b"\n") + 1 or len(begin)].decode(name)
        except UnicodeDecodeError:
            continue
        return name if _is_plain(text) else None
    return None


def number_of(cell: str, comma: bool) -> float | None:
    """Return a cell's number, NaN for a missing one, None for a word.

    A date and time becomes s; one without a zone is taken as UTC, so that no clock changes within a recording.
    """
    text = cell.strip().strip('"')
    plain = text.replace(",", ".") if comma else text
    try:
        return float(plain)
    except ValueError:
        if text.lower() in MISSING:
            return math.nan
    if exponent := FORTRAN.fullmatch(plain):
        return float(f"{exponent[1]}e{exponent[2]}")
    return _stamp(text)


def _stamp(text: str) -> float | None:
    """Return a date and time, as 2026-11-29T12:00:00.25, or a time of day, in s."""
    try:
        stamp = datetime.fromisoformat(text)
        return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
    except ValueError:
        clock = CLOCK.fullmatch(text)
    if clock is None:
        return None
    return int(clock[1]) * 3600 + int(clock[2]) * 60 + float(clock[3].replace(",", "."))


def _is_plain(text: str) -> bool:
    return all(character.isprintable() or character.isspace() or character == "\ufeff" for character in text)
