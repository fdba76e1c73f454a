"""From what motion says is wrong to refusals, joints by name."""

from collections.abc import Sequence

from motion.errors import CannotStop, Infeasible, InvalidMotion, LimitExceeded, MotionError, OutOfTime, SolverFailed
from protocol.errors import Refusal
from robot.motion_check import Collides
from robot.tool_target import Unreachable
from robot.torque_check import TorqueExceeded


def refusal_of(error: MotionError, names: Sequence[str]) -> Refusal:
    """Return the refusal that says what `error` says, joints by `names`."""
    if isinstance(error, InvalidMotion):
        return invalid(error)
    index = getattr(error, "joint", 0)
    joint = names[index]
    sentence = str(error).replace(f"joint {index}", joint, 1)
    match error:
        case LimitExceeded():
            detail = {"quantity": error.quantity, "value": error.value, "bound": error.bound}
            return Refusal("limit", sentence, joint=joint, **detail)
        case TorqueExceeded():
            detail = {"quantity": "torque", "value": error.value, "bound": error.bound, "time_from_start": error.time}
            return Refusal("limit", sentence, joint=joint, **detail, min_duration=error.min_duration)
        case Collides():
            where = {"body": error.body, "other": error.other, "time_from_start": error.time}
            return Refusal("collision", sentence, **where, distance=error.distance)
        case Infeasible():
            return Refusal(
                "infeasible",
                sentence,
                joint=joint,
                quantity=error.quantity,
                time_from_start=error.time,
                min_duration=error.min_duration,
                waypoint_times=error.waypoint_times,
            )
        case CannotStop():
            return Refusal("cannot_stop", sentence, joint=joint, max_velocity=error.max_velocity)
        case OutOfTime():
            return Refusal("solver_failed", sentence, joint=joint, status=error.status, min_duration=error.min_duration)
        case SolverFailed():
            return Refusal("solver_failed", sentence, joint=joint, status=error.status)
    raise error


def none_of(errors: list[MotionError], names: Sequence[str]) -> Refusal:
    """Return the refusal of a goal none of whose ends can be planned: the first's, with the codes of the others."""
    own, *others = (refusal_of(error, names) for error in errors)
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
