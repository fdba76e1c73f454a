"""Checks of a goal that do not depend on the start."""

import math

from motion.primitive import Primitive
from protocol import messages as m
from protocol.codec import check_lengths
from protocol.errors import Refusal
from protocol.topics import MAX_PLAN_S, id_fault
from robot.description import RobotConfig

MAX_FOLLOW_THROUGH_S = 0.5
SHORTEST, LONGEST = 1e-6, 1e6
"""Allowed length of a direction or a quaternion, which is then scaled to 1."""
NOT_IN_KEYS = "/*$?#"
"""Characters that the client_id of a lease cannot have."""
NOT_FASTEST = {
    "duration": "fixes it",
    "arrival_time": "fixes it",
    "waypoints": "have fixed times",
    "alternatives": "are compared at their own durations",
}
"""Fields that a goal with `fastest` cannot have, and why."""
LARGEST = 1e4
"""Largest coordinate of a tool goal, m, m/s or rad/s; no arm reaches more."""


def check_goal(goal: m.Goal, primitive: Primitive, config: RobotConfig) -> None:
    """Raise a Refusal, `invalid_goal` or `bad_message`, for a goal that contradicts itself."""
    if primitive.joint_count != config.joint_count:
        sentence = (
            f"primitive {goal.primitive!r} moves {primitive.joint_count} joints, the arm has {config.joint_count}"
        )
        raise _invalid("primitive", sentence)
    _check_times(goal)
    _check_names(goal)
    if goal.start is not None and not goal.plan_only:
        raise _invalid("start", "start is for plan_only goals; a motion that is played continues the reference")
    if goal.start is not None and goal.revises is not None:
        raise _invalid("start", "start contradicts revises: a correction continues the motion that it corrects")
    if goal.tail == "coast" and not goal.plan_only:
        raise _invalid("tail", "tail 'coast' is for plan_only goals; an arm must come to rest")
    if not 0 <= goal.follow_through <= MAX_FOLLOW_THROUGH_S:
        sentence = f"follow_through is {goal.follow_through} s; it must lie between 0 and {MAX_FOLLOW_THROUGH_S} s"
        raise _invalid("follow_through", sentence)
    if goal.follow_through > 0 and goal.tail == "coast":
        raise _invalid("follow_through", "follow_through needs the tail 'stop'; a motion that coasts does not end")
    _check_tolerance(goal)
    _check_method(goal)
    _check_tool(goal)
    _check_alternatives(goal, config.joint_count)


def too_long(goal: m.Goal, duration: float, total_duration: float) -> Refusal:
    """Return the refusal of a motion that is, with its stop, longer than a plan may be."""
    sentence = (
        f"the motion takes {duration:.3f} s and its stop {total_duration - duration:.3f} s, together more than the "
        f"{MAX_PLAN_S} s of the longest plan; end it sooner or slower"
    )
    return _invalid("duration" if goal.arrival_time is None else "arrival_time", sentence)


def _check_times(goal: m.Goal) -> None:
    if goal.duration is not None and goal.arrival_time is not None:
        raise _invalid("arrival_time", "give duration or arrival_time, not both")
    _check_duration(goal.duration, "duration")
    if not goal.fastest:
        return
    for field, reason in NOT_FASTEST.items():
        if getattr(goal, field) not in (None, []):
            raise _invalid("fastest", f"fastest finds the duration itself, and {field} {reason}; give one of the two")


def _check_duration(duration: float | None, field: str) -> None:
    if duration is not None and not 0 < duration <= MAX_PLAN_S:
        sentence = f"{field} is {duration} s; it must be greater than 0 and at most {MAX_PLAN_S} s"
        raise _invalid(field, sentence)


def _check_names(goal: m.Goal) -> None:
    if goal.lease and not goal.client_id:
        raise _invalid("client_id", "a lease needs the client_id that holds the token")
    for field, name in (("client_id", goal.client_id or None), ("goal_id", goal.goal_id), ("revises", goal.revises)):
        if name is not None and (sentence := id_fault(field, name)):
            raise _invalid(field, sentence)
    if goal.lease and not {*goal.client_id}.isdisjoint(NOT_IN_KEYS):
        sentence = f"client_id {goal.client_id!r} has one of {' '.join(NOT_IN_KEYS)}, which its token's key cannot have"
        raise _invalid("client_id", f"{sentence}; take another name for a lease")


def _check_tolerance(goal: m.Goal) -> None:
    for name in ("positions", "velocities"):
        value = getattr(goal.tolerance, name, None)
        if value is not None and value <= 0:
            raise _invalid(f"tolerance.{name}", f"tolerance.{name} is {value}; it must be greater than 0, or null")


def _check_method(goal: m.Goal) -> None:
    """Refuse fields that only the method "qp" supports."""
    if goal.method == "qp":
        return
    asked = {
        "fastest": goal.fastest,
        "alternatives": bool(goal.alternatives),
        "revises": goal.revises is not None,
        "place_time": goal.place_time is not None,
        "follow_through": goal.follow_through != 0,
    }
    if goal.method == "dmp":
        asked["start.accelerations"] = goal.start is not None and goal.start.accelerations is not None
    for field in (field for field, is_asked in asked.items() if is_asked):
        raise _invalid(field, f"{field} is for method 'qp', and this goal asks for {goal.method!r}; leave one out")


def _check_tool(goal: m.Goal) -> None:
    """Refuse fields that duplicate or contradict the tool's pose."""
    if goal.tool is not None:
        _check_pose(goal.tool, "tool")
        for field, end in [("", goal), *((f"alternatives[{k}].", end) for k, end in enumerate(goal.alternatives))]:
            for name in ("positions", "velocities"):
                if getattr(end, name) is not None:
                    sentence = f"tool says how the arm ends, and {field}{name} would say it again; give one of the two"
                    raise _invalid(f"{field}{name}", sentence)
    for index, waypoint in enumerate(goal.waypoints):
        field = f"waypoints[{index}]"
        if waypoint.tool is None:
            continue
        _check_pose(waypoint.tool, f"{field}.tool")
        if waypoint.positions is not None or waypoint.velocities is not None:
            sentence = f"{field} has a tool in place of positions and velocities; give one of the two"
            raise _invalid(f"{field}.tool", sentence)


def _check_pose(tool: m.ToolGoal, field: str) -> None:
    if tool.orientation is not None and tool.axis is not None:
        sentence = f"{field} has an orientation and an axis, which each say where the tool points; give one of them"
        raise _invalid(f"{field}.axis", sentence)
    for name in ("orientation", "axis"):
        value = getattr(tool, name)
        if value is not None and not SHORTEST <= math.hypot(*value) <= LONGEST:
            sentence = f"{field}.{name} is {list(value)}; its length must lie between {SHORTEST:g} and {LONGEST:g}"
            raise _invalid(f"{field}.{name}", sentence)
    for name in ("position", "velocity", "angular_velocity"):
        value = getattr(tool, name) or (0.0,)
        if max(map(abs, value)) > LARGEST:
            sentence = f"{field}.{name} is {list(value)}; its numbers must lie within {LARGEST:g} of 0"
            raise _invalid(f"{field}.{name}", sentence)


def _check_alternatives(goal: m.Goal, joints: int) -> None:
    if len(goal.alternatives) > m.MAX_ALTERNATIVES:
        sentence = f"alternatives has {len(goal.alternatives)} entries; at most {m.MAX_ALTERNATIVES} are taken"
        raise _invalid("alternatives", sentence)
    for index, end in enumerate(goal.alternatives):
        field = f"alternatives[{index}]"
        given = {name: getattr(end, name) for name in ("positions", "velocities", "accelerations")}
        check_lengths(joints, **{f"{field}.{name}": v for name, v in given.items() if v is not None})
        if end.duration is not None and end.arrival_time is not None:
            raise _invalid(f"{field}.arrival_time", f"{field}: give duration or arrival_time, not both")
        _check_duration(end.duration, f"{field}.duration")
        if (goal.rest_fraction or goal.follow_through) and any(end.accelerations or ()):
            sentence = "must be null or 0 with a rest_fraction or a follow_through"
            raise _invalid(f"{field}.accelerations", f"{field}.accelerations {sentence}")


def _invalid(field: str, sentence: str) -> Refusal:
    return Refusal("invalid_goal", sentence, field=field)
