"""Correct MuJoCo's specification of a URDF before it is compiled."""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path

import mujoco

from robot.schema import RobotError
from robot.urdf import UrdfJoint

PACKAGE = "package:"
READABLE = (".stl", ".obj", ".msh")


def prepare(spec: mujoco.MjSpec, path: Path, joints: Mapping[str, UrdfJoint]) -> None:
    """Correct the specification of the URDF at `path`; `joints` are those that `read_urdf` returns.

    Links with fixed joints remain separate bodies, so that each can carry the tool. Links that a joint connects may
    overlap in a URDF, so their collisions are disabled. `package://` paths of meshes are resolved. A negative effort
    means no limit.

    Raises:
        RobotError: a mesh is missing or has a format that MuJoCo cannot read.
    """
    spec.compiler.fusestatic = False
    for mesh in spec.meshes:
        mesh.file = str(find_mesh(mesh.file, path.absolute().parent, spec.meshdir))
    for joint in joints.values():
        if joint.moves and joint.effort is not None and joint.effort < 0:
            spec.joint(joint.name).actfrclimited = False
    _exclude_neighbours(spec)


def _exclude_neighbours(spec: mujoco.MjSpec) -> None:
    """Disable collisions between each body and its parent, also if the parent is fixed to the world."""
    for body in spec.bodies:
        neighbour = body.parent if body.joints else None
        while neighbour is not None and neighbour.parent is not None:
            spec.add_exclude(bodyname1=neighbour.name, bodyname2=body.name)
            neighbour = None if neighbour.joints else neighbour.parent


def find_mesh(name: str, folder: Path, meshdir: str = "") -> Path:
    """Return the file of a mesh: in a package, in `folder`, or absolute.

    Raises:
        RobotError: the file does not exist, or MuJoCo cannot read its format.
    """
    if Path(name).suffix.lower() not in READABLE:
        raise RobotError(f"mesh {name}: MuJoCo reads {', '.join(READABLE)}; convert it and change the name in the URDF")
    tried = list(_places(name, folder, meshdir))
    for place in tried:
        if place.is_file():
            return place
    where = (
        "put its package beside or above the URDF, or name the folder that holds the package in ROS_PACKAGE_PATH"
        if name.startswith(PACKAGE)
        else f"it is looked for at {tried[0]}"
    )
    raise RobotError(f"mesh {name} is missing; {where}")


def _places(name: str, folder: Path, meshdir: str) -> Iterator[Path]:
    """Yield candidate files of a mesh; the last is MuJoCo's own, which ignores the directories of mesh paths."""
    stripped = folder / meshdir / Path(name).name
    if not name.startswith(PACKAGE):
        yield folder / meshdir / name.removeprefix("file:").replace("//", "/")
        yield stripped
        return
    package, _, rest = name.removeprefix(PACKAGE).lstrip("/").partition("/")
    for above in (folder, *folder.parents):
        yield above / package / rest
        if above.name == package:
            yield above / rest
    for root in filter(None, os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)):
        yield Path(root) / package / rest
        if Path(root).name == package:
            yield Path(root) / rest
    yield stripped
