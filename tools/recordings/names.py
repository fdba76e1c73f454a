"""Words in the names of columns: units, times, and quantities other than joint positions."""

import math
import re
from collections.abc import Iterable

from tools.recordings.recording import Unit

WORD = re.compile(r"[a-z°µ%]+|\d+")

ANGLES = {
    **dict.fromkeys(("rad", "rads", "radian", "radians"), 1.0), "mrad": 1e-3,
    **dict.fromkeys(("deg", "degree", "degrees", "°"), math.pi / 180), "mdeg": math.pi / 180e3, "gon": math.pi / 200,
    "arcmin": math.pi / 10_800,
    **dict.fromkeys(("rev", "revs", "revolutions", "turn", "turns"), 2 * math.pi),
}  # fmt: skip
"""Units of angles, in rad."""

NO_ANGLES = frozenset(
    {"%", "percent", "ticks", "tick", "counts", "count", "steps", "pulses", "normalized", "normalised"}
)
"""Units of joint positions that are not angles; an arm's calibration converts them."""

POSITION = frozenset(
    {"pos", "position", "positions", "actual", "measured", "value", "field", "qpos", "angle", "angles"}
)
"""Words for a position, which are not part of the joint's name."""

JOINT = frozenset({"q", "j", "joint", "joints", "axis", "motor", "dof", "theta", "rax", "gelenk", "achse"})
"""Words for a joint, which are equivalent before a number."""

OTHER = frozenset(
    {
        "vel", "velocity", "velocities", "qd", "dq", "qvel", "speed", "speeds", "acc", "acceleration", "accelerations",
        "qdd", "ddq", "effort", "efforts", "torque", "torques", "tau", "moment", "force", "current", "currents",
        "temperature", "voltage", "target", "desired", "command", "commanded", "cmd", "goal", "action", "tcp", "ee",
        "eef", "pose", "quat", "error", "stamp", "timestamp", "time", "seq", "frame", "index", "id", "mode", "status",
        "reference", "planned", "demonstrated", "limits", "des", "ref", "setpoint", "qdot", "qddot", "accel", "temp",
        "power", "load", "pwm",
    }
)  # fmt: skip
"""Words for quantities other than measured joint positions."""

GRIPPER = frozenset({"gripper", "finger", "fingers", "fingertip", "hand", "jaw", "claw"})

POSES = frozenset({"pose", "poses", "ee", "eef", "tcp", "quat", "quaternion", "tool", "orientation"})
"""Words for poses of the tool."""

POSES_CURE = "examples/tool_poses.py computes joint positions from poses, by inverse kinematics along the path"
ONLY_POSES = "has poses of the tool ({}) and no joint positions; " + POSES_CURE


def words(name: str) -> tuple[str, ...]:
    """Return the words and numbers of a name in lower case, with camel case split: ("panda", "joint", "1")."""
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower().replace("μ", "µ")
    return tuple(WORD.findall(text.lstrip("%")))


def joint_words(name: str) -> tuple[str, ...]:
    """Return the words that identify a joint, without units and words for a position; words for a joint become `joint`.

    `joint` is kept only before a number, so that `shoulder_pan_joint` and `shoulder_pan.pos` are equal.
    """
    kept = [word for word in words(name) if word not in POSITION | NO_ANGLES and word not in ANGLES]
    spelled = ["joint" if word in JOINT else word for word in kept]
    joints = [
        word
        for index, word in enumerate(spelled)
        if word != "joint" or (spelled[index + 1 : index + 2] and spelled[index + 1].isdecimal())
    ]
    return tuple(str(int(word)) if word.isdecimal() else word for word in joints)


def is_pose(name: str) -> bool:
    """Return whether an array, column or message has poses of the tool, by its name."""
    return bool(POSES & set(words(name)))


def are_poses(columns: Iterable[str]) -> bool:
    """Return whether columns are poses, with columns named x, y and z."""
    return {"x", "y", "z"} <= {word for column in columns for word in words(column)}


def unit_of(name: str) -> Unit | None:
    """Return the unit in the name of an array, or in an attribute; None for other units."""
    scale = scale_of(name)
    return "rad" if scale == 1.0 else "deg" if scale == math.pi / 180 else None


def scale_of(name: str) -> float | None:
    """Return the unit of angles in a column's name, rad; None without one."""
    return next((ANGLES[word] for word in words(name) if word in ANGLES), None)


def is_no_angle(name: str) -> bool:
    """Return whether a column's name has a unit that is not one of angles."""
    return bool(NO_ANGLES & set(words(name)))


def is_gripper(name: str) -> bool:
    """Return whether a column belongs to a gripper, by its name."""
    return bool(GRIPPER & set(words(name)))


def is_other(name: str) -> bool:
    """Return whether a column is a quantity other than a joint position, for example a time, velocity or torque."""
    return bool(OTHER & set(words(name)))
