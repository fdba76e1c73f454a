"""Types of flags: the placeholder of the value in the help, without defaults that carry no information."""

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, UseAppendAction, arg


def _quiet(metavar: str | None = None) -> object:
    return arg(metavar=metavar, help_behavior_hint="")


Switch = Annotated[bool, _quiet()]
Seconds = Annotated[float | None, _quiet("S")]
Number = Annotated[float | None, _quiet("X")]
Identifier = Annotated[str | None, _quiet("ID")]
Words = Annotated[tuple[str, ...], _quiet("X ...")]
"""A vector over joints, one word each."""
Coordinates = Annotated[tuple[str, ...], _quiet("X Y Z")]
Place = Annotated[tuple[float, float, float], _quiet("X Y Z")]
MaybePlace = Annotated[tuple[float, float, float] | None, _quiet("X Y Z")]
Endpoints = UseAppendAction[Annotated[tuple[str, ...], arg(metavar="ENDPOINT")]]
"""One word a flag: a flag of any number of words may take none, and then leaves its word to a missing NAME or ID."""
File = Annotated[Path | None, _quiet("FILE")]
RobotConfigFile = Annotated[Path, _quiet("FILE")]

Name = Positional[Annotated[str, _quiet("NAME")]]
NamedGoal = Positional[Annotated[str, _quiet("ID")]]
AnyGoal = Positional[Annotated[str | None, _quiet("ID")]]
Source = Positional[Annotated[Path, _quiet("FILE")]]
ToolPoints = UseAppendAction[Annotated[tuple[str, ...], arg(metavar="TIME:X,Y,Z")]]
Points = UseAppendAction[Annotated[tuple[str, ...], arg(metavar="TIME:POSITIONS")]]
"""A flag that may be given several times."""
