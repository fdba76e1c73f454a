"""From what motion says is wrong to refusals, joints by name."""

from collections.abc import Sequence

from motion.errors import CannotStop, Infeasible, InvalidMotion, LimitExceeded, MotionError, OutOfTime, SolverFailed
from protocol.errors import CODES, Refusal
from robot.conversions import collision_refusal
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
"""The code of each kind of error, and details beside those that the code has; the first kind that fits counts."""


def refusal_of(error: MotionError, names: Sequence[str]) -> Refusal:
    """Return the refusal that says what `error` says, joints by `names`."""
    if isinstance(error, InvalidMotion):
        return invalid(error)
    if isinstance(error, Collides):
        return collision_refusal(error)
    for kind, (code, *more) in KINDS.items():
        if isinstance(error, kind):
            index = getattr(error, "joint", 0)
            known = {**vars(error), "joint": names[index], "time_from_start": getattr(error, "time", None)}
            sentence = str(error).replace(f"joint {index}", names[index], 1)
            return Refusal(code, sentence, **{name: known[name] for name in (*CODES[code], *more)})
    raise error


def none_of(errors: list[MotionError | Refusal], names: Sequence[str]) -> Refusal:
    """Return the refusal of a goal none of whose ends can be planned: the first's, with the codes of the others."""
    own, *others = (error if isinstance(error, Refusal) else refusal_of(error, names) for error in errors)
    sentence = f"{own.message}; nor can any of the {len(others)} alternatives be planned"
    return Refusal(own.code, sentence, **own.detail, alternatives=[refusal.code for refusal in others])


def unreachable(error: Unreachable, field: str) -> Refusal:
    """Return the refusal of a tool's goal that no posture meets; `field` is where it stands, as `waypoints[0].`."""
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
