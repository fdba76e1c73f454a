"""A URDF's joints, read beside MuJoCo, which drops velocity limits and misreads implausible ranges silently."""

import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

from robot.schema import RobotError

MAX_BYTES = 50_000_000
"""A larger file is no URDF: meshes are files of their own."""


@dataclass(frozen=True, slots=True)
class UrdfJoint:
    """A joint as the file has it; limits are None where it has none.

    Attributes:
        name: Of the joint.
        kind: revolute, continuous, prismatic or fixed.
        parent: Link that carries it.
        child: Link that it moves.
        lower: End of the range, rad or m.
        upper: End of the range, rad or m.
        velocity: Limit, rad/s or m/s.
        effort: Limit, N·m or N.
        mimics: The joint that it follows.
        limited: The file gives limits, even if the joint is fixed.
    """

    name: str
    kind: str
    parent: str
    child: str
    lower: float | None
    upper: float | None
    velocity: float | None
    effort: float | None
    mimics: str | None
    limited: bool

    @property
    def moves(self) -> bool:
        """Whether it has a single axis."""
        return self.kind in ("revolute", "continuous", "prismatic")

    @property
    def looks_movable(self) -> bool:
        """Whether it is fixed, but has limits as if it should move."""
        return self.kind == "fixed" and self.limited

    @property
    def unknown(self) -> dict[str, float]:
        """Limits that no joint can have, and that stand for unknown, by their name in the file."""
        given = {"velocity": self.velocity, "effort": self.effort} if self.moves else {}
        return {key: value for key, value in given.items() if value is not None and value <= 0}


def is_urdf(path: Path) -> bool:
    """Return whether the file is named as a URDF."""
    return path.suffix.lower() == ".urdf"


def read_urdf(path: Path) -> dict[str, UrdfJoint]:
    """Return the joints of a URDF by name.

    Raises:
        RobotError: the file is no URDF, or a joint of it cannot be meant.
    """
    try:
        root = _parse(path.read_bytes())
    except OSError as error:
        raise RobotError(f"{path}: cannot be read ({error.strerror}); name a URDF or MJCF file") from error
    except expat.ExpatError as error:
        raise RobotError(f"{path}: is no XML: {error}") from error
    if any(element.tag.startswith("xacro:") for element in root.iter()):
        raise RobotError(f"{path}: is a xacro file; expand it first: xacro FILE.xacro > FILE.urdf")
    if root.tag != "robot":
        raise RobotError(f"{path}: its root is <{root.tag}>; a URDF's is <robot>")
    joints = [_joint(element) for element in root.findall("joint")]
    for what, names in (
        ("link", [link.get("name", "") for link in root.findall("link")]),
        ("joint", [joint.name for joint in joints]),
    ):
        if repeated := [name for name, count in Counter(names).items() if count > 1]:
            raise RobotError(f"{path}: the name {repeated[0]!r} is repeated; give each {what} a name of its own")
    return {joint.name: joint for joint in joints}


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
            raise RobotError(f"{name}: limit {key}={text!r} is no number") from None
        return value if value is None or math.isfinite(value) else None

    joint = UrdfJoint(
        name=name,
        kind=kind,
        parent=_link(element, "parent"),
        child=_link(element, "child"),
        lower=number("lower"),
        upper=number("upper"),
        velocity=number("velocity"),
        effort=number("effort"),
        mimics=None if mimic is None else mimic.get("joint"),
        limited=limit is not None,
    )
    if joint.kind in ("floating", "planar"):
        raise RobotError(f'{joint.child} floats freely: {name} is {kind}; an arm stands still, write type="fixed"')
    if joint.moves and joint.kind != "continuous" and (joint.lower or 0.0) > (joint.upper or 0.0):
        raise RobotError(
            f"{name}: its range begins at {joint.lower:g} and ends at {joint.upper or 0.0:g}; exchange lower and upper"
        )
    return joint


def _link(element: ElementTree.Element, tag: str) -> str:
    found = element.find(tag)
    return "" if found is None else found.get("link", "")
