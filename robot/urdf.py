"""Parser of a URDF's joints. MuJoCo's silently drops velocity limits and misreads implausible ranges."""

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

from robot.schema import RobotError

MAX_BYTES = 50_000_000
"""Largest size of a URDF, bytes; meshes are separate files."""
ROOT = re.compile(rb"\A(?:[^<]|<!--.*?-->|<[?!][^>]*>)*<robot\b", re.DOTALL)
"""Begin of a URDF: its root, after the declaration and comments."""
XACRO = "expand it first: xacro FILE.xacro > FILE.urdf"
"""Cure for a xacro file."""


@dataclass(frozen=True, slots=True)
class UrdfJoint:
    """A joint of the file; missing limits are None.

    Attributes:
        name: Name of the joint.
        kind: revolute, continuous, prismatic or fixed.
        velocity: Velocity limit, rad/s or m/s.
        effort: Effort limit, N·m or N.
        lower: Begin of its range, rad or m; 0 if missing.
        upper: End of its range.
        mimics: Name of the joint that it mimics.
        limited: Whether the file gives limits, even for a fixed joint.
    """

    name: str
    kind: str
    velocity: float | None
    effort: float | None
    lower: float
    upper: float
    mimics: str | None
    limited: bool

    @property
    def moves(self) -> bool:
        """Whether the joint has a single axis."""
        return self.kind in ("revolute", "continuous", "prismatic")

    @property
    def doubts(self) -> Iterator[str]:
        """Yield sentences about implausible limits."""
        if self.kind == "fixed" and self.limited:
            yield f'{self.name} is fixed, but has limits; if it should move, write type="revolute"'
        if self.moves:
            for key, value in (("velocity", self.velocity), ("effort", self.effort)):
                if value is not None and value <= 0:
                    yield f"{self.name}: {key} is {value:g}, which is taken for unknown; write the true limit"
            if self.kind != "continuous" and self.lower == self.upper:
                yield (
                    f"{self.name}: its range begins and ends at {self.lower:g}, which is taken for no range; "
                    "write lower and upper"
                )


def read_urdf(path: Path) -> dict[str, UrdfJoint]:
    """Return the joints of a URDF by name; empty for a file not named `.urdf`.

    Raises:
        RobotError: the file is not a URDF, or one of its joints is invalid; or it is a URDF with another name.
    """
    if path.suffix != ".urdf":
        _check_is_no_urdf(path)
        return {}
    try:
        root = _parse(path.read_bytes())
    except OSError as error:
        raise RobotError(f"{path}: cannot be read ({error.strerror}); name a URDF or MJCF file") from error
    except expat.ExpatError as error:
        raise RobotError(f"{path}: is not XML: {error}; correct the file there, or export it again") from error
    if any(element.tag.startswith("xacro:") for element in root.iter()):
        raise RobotError(f"{path}: is a xacro file; {XACRO}")
    if root.tag != "robot":
        raise RobotError(f"{path}: its root is <{root.tag}>; a URDF's is <robot>, and an MJCF's name ends in .xml")
    joints = [_joint(element) for element in root.findall("joint")]
    for what, names in (
        ("link", [link.get("name", "") for link in root.findall("link")]),
        ("joint", [joint.name for joint in joints]),
    ):
        if repeated := [name for name, count in Counter(names).items() if count > 1]:
            raise RobotError(f"{path}: the name {repeated[0]!r} is repeated; give each {what} a name of its own")
    by_name = {joint.name: joint for joint in joints}
    for joint in joints:
        if joint.mimics is not None and not (joint.mimics in by_name and by_name[joint.mimics].moves):
            raise RobotError(
                f"{path}: {joint.name} follows {joint.mimics}, which is not a moving joint; correct or remove <mimic>"
            )
    return by_name


def _check_is_no_urdf(path: Path) -> None:
    """Refuse a URDF named `.xml`: MuJoCo reads it, but without the corrections that a URDF needs."""
    if path.suffix == ".xml" and path.is_file() and ROOT.search(path.read_bytes()):
        raise RobotError(f"{path}: is a URDF, because its root is <robot>; rename it to {path.stem}.urdf")


def _parse(text: bytes) -> ElementTree.Element:
    """Parse XML without document type, so that no entity can expand; prefixes may be undeclared, as in many URDFs."""
    if len(text) > MAX_BYTES:
        raise RobotError(f"the file has {len(text)} bytes; a URDF has at most {MAX_BYTES}")
    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate()
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.StartDoctypeDeclHandler = _refuse_doctype
    parser.Parse(text, True)
    return builder.close()


def _refuse_doctype(*_: object) -> None:
    raise RobotError("the file declares a document type; a URDF has none, remove <!DOCTYPE>")


def _joint(element: ElementTree.Element) -> UrdfJoint:
    name, kind = element.get("name", ""), element.get("type", "")
    limit, mimic = element.find("limit"), element.find("mimic")

    def number(key: str) -> float | None:
        text = None if limit is None else limit.get(key)
        try:
            value = None if text is None else float(text)
        except ValueError:
            cure = XACRO if text is not None and "$" in text else "write a number"
            raise RobotError(f"{name}: limit {key}={text!r} is not a number; {cure}") from None
        return value if value is None or math.isfinite(value) else None

    if kind in ("floating", "planar"):
        child = element.find("child")
        moved = name if child is None else child.get("link", "")
        raise RobotError(f'{moved} floats freely: {name} is {kind}; an arm stands still, write type="fixed"')
    lower, upper = number("lower") or 0.0, number("upper") or 0.0
    if kind in ("revolute", "prismatic") and lower > upper:
        raise RobotError(f"{name}: its range begins at {lower:g} and ends at {upper:g}; exchange lower and upper")
    return UrdfJoint(
        name=name,
        kind=kind,
        velocity=number("velocity"),
        effort=number("effort"),
        lower=lower,
        upper=upper,
        mimics=None if mimic is None else mimic.get("joint"),
        limited=limit is not None,
    )
