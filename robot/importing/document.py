"""The text of a robot's TOML, with the origin of each value as a comment."""

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from robot.importing.limits import JointLimits, Value
from robot.model import Tool

DECIDE = "DECIDE"
"""Mark of values that no file contains and the user must look up."""
RATE_HZ = 1000
ALPHA = 50.0
SILENCE_TICKS = 20
MAX_TRACKING_ERROR = 0.1
"""rad. At this error eq. 11 adds alpha²/4 times as much to the reference acceleration: 62.5 rad/s²."""
MARGIN = 0.01


@dataclass(frozen=True, slots=True)
class Entry:
    """A line of the TOML: `key = value  # comment`, or without a key only a comment."""

    key: str = ""
    value: str = ""
    comment: str = ""


@dataclass(frozen=True, slots=True)
class Contents:
    """Values to write for an arm; vectors are (J,), in the order of `joint_names`."""

    name: str
    model: str
    source: str
    tool: Tool
    tool_origin: str
    joint_names: Sequence[str]
    home: np.ndarray
    home_origin: str
    limits: JointLimits
    held: dict[str, float]
    notes: Sequence[str]


def to_toml(contents: Contents) -> str:
    """Return the TOML."""
    tables = {"": _top(contents), "joints": _joints(contents), "held": _held(contents), "collision": _collision()}
    blocks = [_block(name, entries) for name, entries in tables.items() if entries]
    return "\n".join([*_head(contents, open_values("".join(blocks))), *blocks])


def open_values(text: str) -> list[str]:
    """Return the keys of a TOML whose values the user must still decide."""
    return re.findall(rf"^(\w+) .*# {DECIDE}", text, re.MULTILINE)


def _head(contents: Contents, open_keys: Sequence[str]) -> list[str]:
    decide = ", ".join(open_keys)
    lines = [
        f"{contents.name}: written by `volley robot import` from {contents.source}.",
        "Beside each value is its origin: file (the model has it), derived (from the model), assumed (nobody says it).",
        f"Look these up, and then remove the word {DECIDE} there: {decide}."
        if decide
        else "Nothing is left to decide.",
        *contents.notes,
    ]
    return [f"# {line}" for line in lines]


def _top(contents: Contents) -> list[Entry]:
    return [
        Entry("name", _text(contents.name)),
        Entry("model", _text(contents.model)),
        Entry("tool", _tool(contents.tool), contents.tool_origin),
        Entry("rate_hz", f"{RATE_HZ}", "assumed; ticks a second"),
        Entry("alpha", f"{ALPHA}", "assumed; gain of the tracking law, 1/s"),
        Entry("silence_ticks", f"{SILENCE_TICKS}", "assumed; ticks without a command before the arm brakes"),
        Entry(
            "max_tracking_error",
            f"{MAX_TRACKING_ERROR}",
            f"{DECIDE}: assumed; rad that a joint may be pushed aside before the arm stops in a fault",
        ),
        Entry("on_fault", '"hold"', "assumed; hold where the arm is, or stop along the motion"),
    ]


def _joints(contents: Contents) -> list[Entry]:
    limits = contents.limits
    entries = [
        Entry(comment="in the order of every vector, from the base to the tool"),
        Entry("names", _list(map(_text, contents.joint_names))),
        Entry("home", _vector(contents.home), contents.home_origin),
        *(
            Entry(key, _vector(value.numbers), _origin(value))
            for key, value in (
                ("velocities", limits.velocities),
                ("accelerations", limits.accelerations),
                ("jerks", limits.jerks),
            )
        ),
    ]
    torques = Entry("torques" if limits.torques.is_open else "# torques", _vector(limits.torques.numbers))
    ranges = Entry("# positions", _list([_vector(pair) for pair in limits.ranges]))
    return [
        *entries,
        replace(torques, comment=f"{_origin(limits.torques)}; N·m, may be tighter here"),
        replace(ranges, comment="file: ranges; rad, may be tighter here"),
    ]


def _origin(value: Value) -> str:
    return f"{DECIDE}: {value.origin}" if value.is_open else value.origin


def _held(contents: Contents) -> list[Entry]:
    entries = [Entry(_key(name), repr(value), contents.home_origin) for name, value in contents.held.items()]
    return entries and [Entry(comment="kept at this value, rad or m"), *entries]


def _collision() -> list[Entry]:
    return [
        Entry("margin", f"{MARGIN}", "assumed; m that plans keep from contact"),
        Entry("ignore", "[]", 'pairs of bodies that may touch, as ["link_1", "table"]'),
    ]


def _block(name: str, entries: Sequence[Entry]) -> str:
    lines = [f"[{name}]"] if name else []
    for entry in entries:
        line = f"{entry.key} = {entry.value}" if entry.key else ""
        comment = f"# {entry.comment}" if entry.comment else ""
        lines.append("  ".join(filter(None, (line, comment))))
    return "\n".join([*lines, ""])


def _tool(tool: Tool) -> str:
    return f"{{ body = {_text(tool.body)} }}" if tool.body else _text(tool.site)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _text(name)


def _vector(values: np.ndarray) -> str:
    """Return numbers in TOML with all their digits: a limit that was rounded up would not be kept."""
    return _list(map(repr, values.tolist()))


def _list(words: Iterable[str]) -> str:
    return f"[{', '.join(words)}]"
