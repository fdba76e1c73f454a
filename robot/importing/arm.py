"""Import of a model: from an MJCF or URDF file to the text of a robot's TOML."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import mujoco

from robot.importing.chain import find_arm
from robot.importing.document import Contents, to_toml
from robot.importing.home import find_home
from robot.importing.limits import find_limits
from robot.model import Tool, compile_model
from robot.urdf import UrdfJoint, read_urdf

NO_TOOL = Tool("")
UNNAMED = "MuJoCo Model"
"""The name that MuJoCo gives a model without one."""
MAX_JOINTS = 16


@dataclass(frozen=True, slots=True)
class Imported:
    """The text of a TOML, and sentences on what was decided or looks wrong."""

    text: str
    notes: list[str]


def import_robot(
    source: Path, out: Path | None, tool: str | None = None, keyframe: str | None = None, name: str | None = None
) -> Imported:
    """Return the TOML of the arm in a model file.

    Args:
        source: MJCF or URDF.
        out: Where the TOML is going to lie; `model` in it is relative where the model lies beside or below.
        tool: A site or a body; by default the one whose name says so, else the last body.
        keyframe: Whose pose is home; by default that of `home`, else the first one.
        name: Of the robot; by default the model's.

    Raises:
        RobotError: the model cannot be loaded, or has no arm that can be driven.
    """
    urdf = read_urdf(source)
    model = compile_model(source, NO_TOOL, urdf)
    arm = find_arm(model, tool)
    home = find_home(model, arm, keyframe)
    limits = find_limits(model, arm.joints, home.positions, urdf)
    notes = [*arm.notes, *home.notes, *_urdf_notes(urdf)]
    addresses = model.jnt_qposadr
    contents = Contents(
        name=name or _robot_name(model, source),
        model=_reference(source, out),
        source=source.name,
        tool=arm.tool,
        tool_origin=arm.tool_origin,
        joint_names=[model.joint(joint).name for joint in arm.joints],
        home=home.positions[addresses[arm.joints]],
        home_origin=home.origin,
        limits=limits,
        held={model.joint(joint).name: float(home.positions[addresses[joint]]) for joint in arm.held},
        notes=notes,
    )
    return Imported(to_toml(contents), notes)


def _robot_name(model: mujoco.MjModel, source: Path) -> str:
    """Return a name that can be a part of the bus's keys."""
    given = model.names.split(b"\0", 1)[0].decode()
    chosen = source.stem if given in ("", UNNAMED) else given
    return re.sub(r"[^a-z0-9_-]+", "_", chosen.lower()).strip("_") or "robot"


def _reference(source: Path, out: Path | None) -> str:
    """Return the model's path as seen from the TOML: relative where it lies beside or below, else absolute."""
    source = source.absolute()
    if out is not None and source.is_relative_to(out.absolute().parent):
        return str(source.relative_to(out.absolute().parent))
    return str(source)


def _urdf_notes(urdf: Mapping[str, UrdfJoint]) -> list[str]:
    """Return sentences on joints that a URDF hardly means so."""
    notes = [doubt for joint in urdf.values() for doubt in joint.doubts]
    mimics = [f"{one.name} follows {one.mimics}" for one in urdf.values() if one.mimics]
    return notes + [f"{mimic} by an equality that MuJoCo keeps softly" for mimic in mimics]
