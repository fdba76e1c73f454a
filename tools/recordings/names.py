"""Words in the names of columns: units, times, and quantities that are no joint position."""

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
"""Units of joint positions that are no angles, unless an arm's calibration is known."""

POSITION = frozenset(
    {"pos", "position", "positions", "actual", "measured", "value", "field", "qpos", "angle", "angles"}
)
"""Words that a joint position's name may have beside the joint's."""

JOINT = frozenset({"q", "j", "joint", "joints", "axis", "motor", "dof", "theta", "rax", "gelenk", "achse"})
"""Words for a joint; before a number they all mean the same."""

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
"""Words of quantities that are no measured joint position."""

GRIPPER = frozenset({"gripper", "finger", "fingers", "fingertip", "hand", "jaw", "claw"})


POSES = frozenset({"pose", "poses", "ee", "eef", "tcp", "quat", "quaternion", "tool", "orientation"})
"""Words of quantities that are poses of the tool."""

POSES_CURE = "examples/tool_poses.py makes joint positions of poses, by inverse kinematics along the path"
ONLY_POSES = "has poses of the tool ({}) and no joint positions; " + POSES_CURE


def words(name: str) -> tuple[str, ...]:
    """Return a name's words and numbers in lower case, camel case taken apart: ("panda", "joint", "1")."""
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower().replace("μ", "µ")
    return tuple(WORD.findall(text.lstrip("%")))


def joint_words(name: str) -> tuple[str, ...]:
    """Return what tells one joint from another: without units and words for a position, `joint` in one spelling.

    `joint` stays before a number only, so that `shoulder_pan_joint` and `shoulder_pan.pos` are the same.
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
    """Whether an array, column or message has the tool's poses."""
    return bool(POSES & set(words(name)))


def are_poses(columns: Iterable[str]) -> bool:
    """Whether columns are poses: some are named x, y and z."""
    return {"x", "y", "z"} <= {word for column in columns for word in words(column)}


def unit_of(name: str) -> Unit | None:
    """Return the unit that an array's name, or an attribute, says."""
    scale = scale_of(name)
    return "rad" if scale == 1.0 else "deg" if scale == math.pi / 180 else None


def scale_of(name: str) -> float | None:
    """Return the unit of angles that a column's name says, in rad."""
    return next((ANGLES[word] for word in words(name) if word in ANGLES), None)


def is_no_angle(name: str) -> bool:
    """Whether a column's name says a unit that is none of angles."""
    return bool(NO_ANGLES & set(words(name)))


def is_gripper(name: str) -> bool:
    """Whether a column is of a gripper rather than of an arm's joint."""
    return bool(GRIPPER & set(words(name)))


def is_other(name: str) -> bool:
    """Whether a column is a time, a velocity, a torque or another quantity that is no joint position."""
    return bool(OTHER & set(words(name)))
