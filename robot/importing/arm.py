"""Import a model: from an MJCF or URDF file to the text of a robot's TOML."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import mujoco

from protocol.topics import check_robot_name
from robot.importing.chain import find_arm
from robot.importing.document import Contents, to_toml
from robot.importing.home import find_home
from robot.importing.limits import find_limits
from robot.model import Tool, compile_model
from robot.schema import RobotError
from robot.urdf import UrdfJoint, read_urdf

NO_TOOL = Tool("")
UNNAMED = "MuJoCo Model"
"""MuJoCo's default name of a model."""
MAX_JOINTS = 16


@dataclass(frozen=True, slots=True)
class Imported:
    """The text of a TOML, with sentences about decisions and suspicious values."""

    text: str
    notes: list[str]


def import_robot(
    source: Path, out: Path | None, tool: str | None = None, keyframe: str | None = None, name: str | None = None
) -> Imported:
    """Return the TOML of the arm in a model file.

    Args:
        source: MJCF or URDF file.
        out: Future path of the TOML; its `model` path is relative if the model is in or below that directory.
        tool: Name of a site or a body; by default the one with a telling name, else the last body before a gripper.
        keyframe: Keyframe of the home pose; by default `home`, else the first one.
        name: Name of the robot; by default the model's.

    Raises:
        RobotError: the model cannot be loaded, or has no arm that can be driven; the name cannot be a part of a key.
    """
    if name is not None:
        _check_name(name)
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


def _check_name(name: str) -> None:
    try:
        check_robot_name(name)
    except ValueError as error:
        raise RobotError(f"--{error}") from None


def _robot_name(model: mujoco.MjModel, source: Path) -> str:
    """Return a name that is valid in keys of the bus."""
    given = model.names.split(b"\0", 1)[0].decode()
    chosen = source.stem if given in ("", UNNAMED) else given
    return re.sub(r"[^a-z0-9_-]+", "_", chosen.lower()).strip("_") or "robot"


def _reference(source: Path, out: Path | None) -> str:
    """Return the model's path for the TOML: relative if it is in or below the TOML's directory, else absolute."""
    source = source.absolute()
    if out is not None and source.is_relative_to(out.absolute().parent):
        return str(source.relative_to(out.absolute().parent))
    return str(source)


def _urdf_notes(urdf: Mapping[str, UrdfJoint]) -> list[str]:
    """Return sentences about suspicious joints of a URDF."""
    notes = [doubt for joint in urdf.values() for doubt in joint.doubts]
    mimics = [f"{one.name} follows {one.mimics}" for one in urdf.values() if one.mimics]
    return notes + [f"{mimic} by an equality that MuJoCo keeps softly" for mimic in mimics]
