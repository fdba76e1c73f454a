"""Parse goals in tool space from the words of a command line."""

from collections.abc import Sequence

import client
from protocol import messages as m
from tools.shell.joints import number, vector
from tools.shell.shell import UsageError

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
