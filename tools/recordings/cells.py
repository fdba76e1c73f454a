"""Decode text files and table cells of programs and spreadsheets."""

import codecs
import math
import re
from datetime import UTC, datetime

BOMS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}

ZEROS = 0.4
"""Fraction of zero bytes that indicates UTF-16 without a mark; for digits it is half, at one parity."""

MISSING = frozenset({"", "na", "n/a", "#n/a", "null", "none", "-", "--"})
"""Cells that mean a missing number."""

FORTRAN = re.compile(r"([+-]?[\d.]+)[dD]([+-]?\d+)")
CLOCK = re.compile(r"(?:\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}[ T]+)?(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)")
"""A time of day, after a date with an unknown order of day and month."""


def encoding_of(begin: bytes) -> str | None:
    """Return the encoding of a text's first bytes, or None if they are not text.

    Bytes beyond ASCII that are not UTF-8 are decoded as Windows-1252, which contains Latin-1's letters: digits and
    delimiters are the same in all such encodings, and ° and µ in these two.
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
    """Return a cell's number, NaN for a missing number, None for a word.

    A date and time becomes s; one without a zone is read as UTC, so that no clock change falls within a recording.
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
    """Return a date and time, for example 2026-11-29T12:00:00.25, or a time of day, in s."""
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
