"""Vectors over joints as words of a command line: `0.17 _ 0.86`, where `_` leaves a joint free."""

import math
from collections.abc import Sequence

from protocol import messages as m
from tools.shell.shell import UsageError

FREE = "_"


def vector(words: Sequence[str], flag: str) -> list[float]:
    """Return one number a joint; the caller checks their count.

    Raises:
        UsageError: a word is not a finite number.
    """
    return [number(word, flag) for word in words]


def partial(words: Sequence[str], flag: str) -> list[float | None]:
    """Return one number a joint, or None for `_`.

    Raises:
        UsageError: as `vector`.
    """
    return [None if word == FREE else number(word, flag) for word in words]


def ranges(words: Sequence[str], flag: str) -> list[tuple[float, float] | None]:
    """Return (low, high) a joint from LOW:HIGH, or None for `_`.

    Raises:
        UsageError: as `vector`, or a word has no colon.
    """
    return [None if word == FREE else _range(word, flag) for word in words]


def waypoint(text: str) -> m.Waypoint:
    """Return the waypoint of TIME:POSITIONS, TIME::VELOCITIES or TIME:POSITIONS:VELOCITIES, comma-separated.

    Raises:
        UsageError: the text has another form, or as `vector`.
    """
    flag = f"--waypoint {text}"
    parts = text.split(":")
    if len(parts) not in (2, 3) or not any(parts[1:]):
        raise UsageError(f"{flag}: write TIME:POSITIONS or TIME:POSITIONS:VELOCITIES, for example 0.5:0.1,_,_,_,_,_")
    positions, velocities = parts[1], parts[2] if len(parts) == 3 else ""
    return m.Waypoint(
        time_from_start=number(parts[0], flag),
        positions=partial(positions.split(","), flag) if positions else None,
        velocities=partial(velocities.split(","), flag) if velocities else None,
    )


def alternative(text: str) -> m.Alternative:
    """Return the alternative of TIME:POSITIONS:VELOCITIES:ACCELERATIONS, vectors comma-separated.

    Parts that are empty or missing at the end are as in the goal. TIME is a duration, or after @ an arrival time.

    Raises:
        UsageError: the text has another form, or as `vector`.
    """
    flag = f"--alternative {text}"
    parts = text.split(":")
    if not 2 <= len(parts) <= 4 or not any(parts):
        raise UsageError(f"{flag}: write TIME:POSITIONS:VELOCITIES:ACCELERATIONS, as 0.8:0.2,0.5,0.8,0,0,0 or @12.5:")
    time, positions, velocities, accelerations = (*parts, "", "")[:4]
    arrives = time.startswith("@")
    return m.Alternative(
        positions=vector(positions.split(","), flag) if positions else None,
        velocities=vector(velocities.split(","), flag) if velocities else None,
        accelerations=partial(accelerations.split(","), flag) if accelerations else None,
        duration=number(time, flag) if time and not arrives else None,
        arrival_time=number(time[1:], flag) if arrives else None,
    )


def by_name(words: Sequence[str]) -> dict[str, float]:
    """Return the value of each joint of the words JOINT VALUE JOINT VALUE ….

    Raises:
        UsageError: a joint has no value, or a value is not a finite number.
    """
    if not words or len(words) % 2:
        raise UsageError("write JOINT VALUE for each joint, for example: finger_joint1 0.02 finger_joint2 0.02")
    return {name: number(word, name) for name, word in zip(words[::2], words[1::2], strict=True)}


def number(word: str, flag: str) -> float:
    """Return the finite number in `word`.

    Raises:
        UsageError: the word is not a finite number.
    """
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(f"{flag}: {word!r} is not a finite number")
    return value


def _range(word: str, flag: str) -> tuple[float, float]:
    low, colon, high = word.partition(":")
    if not colon:
        raise UsageError(f"{flag}: {word!r} is not a range; write LOW:HIGH, or _ for the robot's own")
    return number(low, flag), number(high, flag)
