"""Convert errors of `motion` to refusals, with joint names."""

from dataclasses import dataclass

from motion.errors import CannotStop, Infeasible, InvalidMotion, LimitExceeded, MotionError, OutOfTime, SolverFailed
from protocol.errors import CODES, Refusal
from robot.conversions import collision_refusal, in_metres
from robot.description import RobotConfig
from robot.motion_check import Collides
from robot.tool_target import Unreachable
from robot.torque_check import TorqueExceeded

KINDS: dict[type[MotionError], tuple[str, ...]] = {
    LimitExceeded: ("limit",),
    TorqueExceeded: ("limit", "time_from_start", "min_duration", "waypoint_times"),
    Infeasible: ("infeasible",),
    CannotStop: ("cannot_stop",),
    OutOfTime: ("solver_failed", "min_duration", "waypoint_times"),
    SolverFailed: ("solver_failed",),
}
"""Code of each kind of error, and extra details; the first matching kind applies."""


@dataclass(frozen=True, slots=True)
class Joints:
    """Names of the arm's joints, and which of them slide."""

    names: tuple[str, ...]
    slides: tuple[bool, ...]


def joints_of(config: RobotConfig) -> Joints:
    """Return the joints that refusals name."""
    return Joints(config.joint_names, config.slides)


def refusal_of(error: MotionError, joints: Joints) -> Refusal:
    """Return the refusal for `error`, with the joint's name and the units of its kind."""
    if isinstance(error, InvalidMotion):
        return invalid(error)
    if isinstance(error, Collides):
        return collision_refusal(error)
    for kind, (code, *more) in KINDS.items():
        if isinstance(error, kind):
            index = getattr(error, "joint", 0)
            name = joints.names[index]
            known = {"joint": name, "time_from_start": getattr(error, "time", None)}
            said = in_metres(str(error)) if joints.slides[index] else str(error)
            sentence = said.replace(f"joint {index}", name, 1)
            detail = {key: known[key] if key in known else getattr(error, key) for key in (*CODES[code], *more)}
            return Refusal(code, sentence, **detail)
    raise error


def none_of(errors: list[MotionError | Refusal], joints: Joints) -> Refusal:
    """Return the refusal of a goal if all ends failed: that of the first end, with the codes of the alternatives."""
    own, *others = (error if isinstance(error, Refusal) else refusal_of(error, joints) for error in errors)
    sentence = f"{own.message}; nor can any of the {len(others)} alternatives be planned"
    return Refusal(own.code, sentence, **own.detail, alternatives=[refusal.code for refusal in others])


def unreachable(error: Unreachable, field: str) -> Refusal:
    """Return the refusal of a tool goal without a posture; `field` is its prefix, for example `waypoints[0].`."""
    nearest = error.nearest
    pose = {"position": nearest.position.tolist(), "orientation": nearest.quaternion.tolist()}
    return Refusal(
        "unreachable",
        f"{field}tool: {error}",
        distance=nearest.distance,
        angle=nearest.angle,
        reason=error.reason,
        nearest=pose,
    )


def not_executed(refusal: Refusal) -> Refusal:
    """Return the refusal of a goal whose plan does not fit `execute`."""
    return Refusal("invalid_goal", f"the plan cannot be executed: {refusal.message}", field="duration")


def invalid(error: InvalidMotion) -> Refusal:
    """Return the refusal of a malformed motion."""
    field = error.field.removeprefix("goal.")
    return Refusal("invalid_goal", f"{field}: {error.message}", field=field)
