"""The tables of a robot's TOML file. Reading them needs no model."""

import difflib
import math
import re
from pathlib import Path
from typing import Literal

import msgspec

from protocol.topics import check_robot_name

OnFault = Literal["hold", "stop"]


class RobotError(ValueError):
    """An invalid robot description; `str()` is a sentence that names the file, the key and what would work."""


class ToolFrame(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Table `tool`: a frame on a body. Position in m, quaternion as w, x, y, z, both in the body's frame."""

    body: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


class Tolerance(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Table `tolerance`: largest error at a hit on any joint, rad and rad/s; inf: no bound."""

    positions: float = math.inf
    velocities: float = math.inf


class JointsTable(msgspec.Struct, forbid_unknown_fields=True):
    """Table `joints`, in the order of every vector on the wire."""

    names: list[str]
    home: list[float] | str
    velocities: list[float]
    accelerations: list[float]
    jerks: list[float]
    positions: list[tuple[float, float]] | None = None
    torques: list[float] | None = None


class CollisionTable(msgspec.Struct, forbid_unknown_fields=True):
    """Table `collision`: smallest distance that plans keep, m, and pairs of bodies that may touch."""

    margin: float = 0.01
    ignore: list[tuple[str, str]] = msgspec.field(default_factory=list)


class RecoilBounds(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Table `racket.recoil`: bounds of a hit's recoil within which it is not a fault.

    window: s before and after the planned hit, and after the first contact with the ball. positions, velocities: the
    largest errors of any joint in the window, rad and rad/s. tolerance: error at which the recoil is over, rad.
    """

    window: float
    positions: float
    velocities: float
    tolerance: float = 0.02


class BallTable(msgspec.Struct, forbid_unknown_fields=True):
    """Table `ball`: flight of the model's body `ball`, and the rate of its measurements.

    drag: 1/m, coefficient of a = −drag·|v|·v. magnus: coefficient of a = magnus·ω × v. rate_hz: measurements a second.
    """

    drag: float = 0.0
    magnus: float = 0.0
    rate_hz: float = 100.0


class RacketTable(msgspec.Struct, forbid_unknown_fields=True):
    """Table `racket`: the geom that hits the ball, a disc or a box, and initial estimates for their contact.

    restitution: of the normal velocity. friction: fraction of the tangential velocity that remains after the contact.
    """

    geom: str | None = None
    restitution: float = 0.8
    friction: float = 0.6
    recoil: RecoilBounds | None = None


class CourtTable(msgspec.Struct, forbid_unknown_fields=True):
    """Table `court`: the geoms of the surface and the net, and initial estimates for a bounce.

    restitution, friction: fractions of the vertical and of the horizontal velocity that remain. dwell: duration of the
    bounce, s. region: [[x, x], [y, y]], m, where a returned ball must land; null: anywhere on the surface.
    """

    surface: str
    net: str | None = None
    restitution: float = 0.75
    friction: float = 0.8
    dwell: float = 0.0
    region: tuple[tuple[float, float], tuple[float, float]] | None = None


class Description(msgspec.Struct, forbid_unknown_fields=True):
    """The TOML file. `tool` is the name of a site, or a frame on a body."""

    name: str
    model: str
    tool: str | ToolFrame
    rate_hz: float
    alpha: float
    silence_ticks: int
    max_tracking_error: float
    joints: JointsTable
    on_fault: OnFault = "hold"
    tolerance: Tolerance = msgspec.field(default_factory=Tolerance)
    held: dict[str, float] = msgspec.field(default_factory=dict)
    others: dict[str, list[str]] = msgspec.field(default_factory=dict)
    collision: CollisionTable = msgspec.field(default_factory=CollisionTable)
    racket: RacketTable | None = None
    ball: BallTable | None = None
    court: CourtTable | None = None


def read_description(path: Path) -> Description:
    """Return the tables of the TOML file at `path`, with checked fields and types.

    Raises:
        RobotError: the file cannot be read, a field is missing, unknown or of another type, or the name is not valid
            in a key.
    """
    try:
        description = msgspec.toml.decode(path.read_bytes(), type=Description)
        check_robot_name(description.name)
    except OSError as error:
        raise RobotError(f"{path}: cannot be read ({error.strerror}); name a robot's TOML file") from error
    except ValueError as error:  # errors of msgspec and of text decoding are ValueErrors
        raise RobotError(f"{path}: {error}{_cure(str(error))}") from error
    return description


def _cure(error: str) -> str:
    """Return what to write in place of a wrong field or value, if that is known."""
    if "on_fault" in error:
        return '; write "hold" or "stop"'
    unknown = re.search(r"unknown field `(.*?)`", error)
    alike = difflib.get_close_matches(unknown[1], FIELDS, 1) if unknown else []
    return f"; did you mean {alike[0]}?" if alike else "; docs/robots.md lists the fields"


TABLES = (
    Description,
    JointsTable,
    ToolFrame,
    CollisionTable,
    Tolerance,
    RacketTable,
    RecoilBounds,
    BallTable,
    CourtTable,
)
FIELDS = sorted({name for table in TABLES for name in table.__struct_fields__})
"""All tables of a robot's TOML, and the names of their fields."""
