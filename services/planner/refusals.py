"""Convert errors of `motion` to refusals, with joint names."""

from collections.abc import Sequence
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


def none_of(errors: Sequence[MotionError | Refusal], whose: Sequence[int], joints: Joints) -> Refusal:
    """Return the refusal of a goal if all ends failed: that of the first end, with the codes of the alternatives.

    whose: for each error the index of the end, ascending: 0 the goal's own, 1 the first alternative. An end in tool
    space has an error for each posture.
    """
    first: dict[int, MotionError | Refusal] = {}
    for index, error in zip(whose, errors, strict=True):
        first.setdefault(index, error)
    own, *others = (error if isinstance(error, Refusal) else refusal_of(error, joints) for error in first.values())
    failed = [f"the {count - 1} other postures that were found"] if (count := list(whose).count(0)) > 1 else []
    failed += [f"any of the {len(others)} alternatives"] if others else []
    sentence = "; nor can ".join([own.message, " or ".join(failed) + " be planned"] if failed else [own.message])
    detail = own.detail | ({"alternatives": [refusal.code for refusal in others]} if others else {})
    return Refusal(own.code, sentence, **detail)


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
