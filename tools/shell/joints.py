"""Vectors over joints and poses of the tool as words of a command line: `0.17 _ 0.86`, where `_` is a free joint."""

import math
from collections.abc import Sequence

import client
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


WAYPOINT_FORM = "write TIME:X,Y,Z or TIME:X,Y,Z:AXIS or TIME:X,Y,Z:W,X,Y,Z; append :VX,VY,VZ for a velocity"


def tool(
    position: Sequence[str],
    orientation: Sequence[str],
    axis: Sequence[str],
    velocity: Sequence[str],
    angular_velocity: Sequence[str],
) -> m.ToolGoal | None:
    """Return the tool goal of the flags' words, or None without any.

    Raises:
        UsageError: the position is missing, or a word is not a number.
    """
    further = {
        "orientation": _numbers(orientation, 4, "--tool-orientation"),
        "axis": _numbers(axis, 3, "--tool-axis"),
        "velocity": _numbers(velocity, 3, "--tool-velocity"),
        "angular_velocity": _numbers(angular_velocity, 3, "--tool-angular-velocity"),
    }
    place = _numbers(position, 3, "--tool")
    if place is not None:
        return client.tool(place, **further)
    given = [f"--tool-{name.replace('_', '-')}" for name, value in further.items() if value is not None]
    if given:
        raise UsageError(f"{given[0]} needs --tool X Y Z: where the tool is to be, m")
    return None


def tool_waypoint(text: str) -> m.Waypoint:
    """Return the waypoint of TIME:X,Y,Z, then optionally an axis or orientation, then optionally a velocity.

    Raises:
        UsageError: the text has another form, or a word is not a finite number.
    """
    flag = f"--tool-waypoint {text}"
    parts = text.split(":")
    if not 2 <= len(parts) <= 4 or not all(parts[:2]):
        raise UsageError(f"{flag}: {WAYPOINT_FORM}")
    time, *groups = (*parts, "", "")[:4]
    place, pointing, velocity = (group.split(",") if group else [] for group in groups)
    whole = len(pointing) == 4
    at = client.tool(
        _numbers(place, 3, flag) or (),
        orientation=_numbers(pointing, 4, flag) if whole else None,
        axis=None if whole else _numbers(pointing, 3, flag),
        velocity=_numbers(velocity, 3, flag),
    )
    return m.Waypoint(time_from_start=number(time, flag), tool=at)


def _numbers(words: Sequence[str], count: int, flag: str) -> list[float] | None:
    """Return `count` numbers, or None without words."""
    if words and len(words) != count:
        raise UsageError(f"{flag}: needs {count} numbers, and these are {len(words)}")
    return vector(words, flag) if words else None


def _range(word: str, flag: str) -> tuple[float, float]:
    low, colon, high = word.partition(":")
    if not colon:
        raise UsageError(f"{flag}: {word!r} is not a range; write LOW:HIGH, or _ for the robot's own")
    return number(low, flag), number(high, flag)
