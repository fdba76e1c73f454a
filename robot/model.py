"""The MuJoCo model of a robot: compile its file, and find joints, bodies and the tool in it."""

import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from robot.compilation import compile_spec
from robot.schema import RobotError
from robot.urdf import XACRO, UrdfJoint
from robot.urdf_model import prepare

TOOL_SITE = "volley_tool"
"""Name of the site that is added for a tool given as a frame on a body."""
CURES = {
    "mass and inertia of moving bodies": "give each link a mass and an inertia (<inertial>)",
    "missing element: 'inertia'": "add <inertia> to that <inertial>, or remove <inertial>",
    "repeated name": "give each a name of its own",
    "Error opening file": "put that file where the model says it is",
    "range[0] should be smaller": "exchange or correct the two numbers",
    "unknown transmission target": "give the joint that name, or remove the actuator",
    "invalid qpos size": "write as many numbers as the model's joints have, or remove the keyframe",
    "XML parse error": "the file is not valid XML; correct that line, or export the file again",
    "empty file": "export it again",
    "unrecognized element": "correct its name, or remove it",
    "unrecognized attribute": "correct its name, or remove it",
    "plugin": "remove the plugin, which this MuJoCo cannot load",
}
"""Cure for each error of MuJoCo, by a part of its text."""
OTHER_CURE = "correct the model; MuJoCo's own viewer (python -m mujoco.viewer) must load it too"
ASIDE = "The visual elements of the spec were discarded"
"""Irrelevant text that MuJoCo adds to an error."""
# MuJoCo's enumeration members do not compare equal to the numbers in its arrays.
FREE = int(mujoco.mjtJoint.mjJNT_FREE)
SINGLE_AXIS = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)


@dataclass(frozen=True, slots=True)
class Tool:
    """The tool's frame: the site of this name in the compiled model.

    body, position (m), quaternion (w, x, y, z): frame of the added site; body is None for a site of the model.
    """

    site: str
    body: str | None = None
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


def compile_model(path: Path, tool: Tool, urdf: Mapping[str, UrdfJoint], visual: bool = False) -> mujoco.MjModel:
    """Compile the MJCF or URDF file at `path`, with the tool's site; `visual`: with visual geometry.

    `urdf`: the joints that `read_urdf` returns.

    Raises:
        RobotError: MuJoCo cannot load the file, or it does not have the tool's body.
    """
    if not path.is_file():
        raise RobotError(f"model: there is no file {str(path)!r}; name an MJCF or URDF file")
    if path.suffix == ".xacro":
        raise RobotError(f"model: {path.name!r} is a xacro file; {XACRO}")
    if path.suffix not in (".xml", ".urdf"):
        raise RobotError(
            f"model: {path.name!r} ends neither in .xml (MJCF) nor in .urdf; rename it, or name another one"
        )
    try:
        with _quiet():
            spec = mujoco.MjSpec.from_file(str(path))
            if urdf:
                prepare(spec, path, urdf)
            if tool.body is not None:
                _add_site(spec, tool)
            return compile_spec(spec, visual)
    except RobotError:
        raise
    except ValueError as error:
        said = " ".join(str(error).partition(ASIDE)[0].split())
        cure = next((cure for part, cure in CURES.items() if part in said), OTHER_CURE)
        raise RobotError(f"model: {path.name!r} cannot be loaded: {said}; {cure}") from error


def is_slide(model: mujoco.MjModel, joint: int) -> bool:
    """Return whether a joint slides (m, N) instead of turning (rad, N·m)."""
    return bool(model.jnt_type[joint] == SINGLE_AXIS[1])


def joint_ids(model: mujoco.MjModel, names: tuple[str, ...], key: str = "joints.names") -> list[int]:
    """Return the indices of the named joints.

    Raises:
        RobotError: a joint is missing or has several axes. The sentence names the TOML's `key`.
    """
    available = [model.joint(i).name for i in range(model.njnt) if model.jnt_type[i] in SINGLE_AXIS]
    for name in names:
        if not name or name not in available:
            raise RobotError(f"{key}: the model has no joint {name!r}; it has {_listed(available)}")
    return [model.joint(name).id for name in names]


def addresses(found: np.ndarray) -> slice | np.ndarray:
    """Return an index of these elements of a model array: a slice if they are adjacent, which is faster."""
    first = int(found[0]) if len(found) else 0
    return slice(first, first + len(found)) if (np.diff(found) == 1).all() else found.astype(np.intp)


def rotation_matrix(quaternion: np.ndarray) -> np.ndarray:
    """Return the rotation matrix (3, 3) of a unit quaternion (4,) w, x, y, z."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def body_name(model: mujoco.MjModel, body: int) -> str:
    """Return the name of a body, or its number if it has none."""
    return model.body(body).name or f"body {body}"


def owner_name(model: mujoco.MjModel, geom: int) -> str:
    """Return the name of a geom's body; for the world's geoms, the geom's name."""
    body = int(model.geom_bodyid[geom])
    return body_name(model, body) if body else model.geom(geom).name or "world"


def check_tool(model: mujoco.MjModel, tool: Tool, moved: list[int]) -> None:
    """Return the tool's frame, which must be on one of the `moved` bodies.

    Raises:
        RobotError: the model has no such site, or none of the joints moves it.
    """
    sites = [model.site(i).name for i in range(model.nsite)]
    if tool.site not in sites:
        raise RobotError(f"tool: the model has no site {tool.site!r}; it has {_listed(sites)}")
    if model.site_bodyid[model.site(tool.site).id] not in moved:
        name = tool.body or tool.site
        raise RobotError(f"tool: none of joints.names moves {name!r}; name a site or a body at the end of the arm")


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress MuJoCo's warnings about attached models: the first one's options apply, and no XML is saved.

    Its warning about a joint without a range is suppressed too: `volley robot check` has a finding.
    """

    def warn(text: str) -> None:
        if not text.startswith("Attach") and "equal lower and upper limits" not in text:
            print(f"MuJoCo: {text}", file=sys.stderr)

    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(warn)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Attach")
            yield
    finally:
        mujoco.set_mju_user_warning(before)


def _add_site(spec: mujoco.MjSpec, tool: Tool) -> None:
    body = spec.body(tool.body)
    if body is None:
        bodies = [body.name for body in spec.bodies if body.name != "world"]
        raise RobotError(f"tool: the model has no body {tool.body!r}; it has {_listed(bodies)}")
    body.add_site(name=tool.site, pos=tool.position, quat=tool.quaternion)


def _listed(names: list[str]) -> str:
    return ", ".join(filter(None, names)) or "none"
