"""From a goal on the wire to a motion request, and from what is wrong with it to a refusal."""

import math
from dataclasses import dataclass

import numpy as np

from motion.errors import CannotStop, Infeasible, InvalidMotion, LimitExceeded, MotionError, SolverFailed
from motion.limits import Limits
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest, Waypoint
from protocol import messages as m
from protocol.codec import check_lengths
from protocol.errors import Refusal
from protocol.topics import MAX_ID, MAX_PLAN_S
from services.robot import RobotConfig

ROUNDING = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Origin:
    """Where and when a motion begins; `epoch` is the controller's, 0 without one."""

    time: float
    epoch: int
    boundary: Boundary


def motion_request(goal: m.Goal, primitive: Primitive, config: RobotConfig, origin: Origin) -> MotionRequest:
    """Return what the planner is to solve; `check_goal` has passed.

    Raises:
        Refusal: `bad_message`, `invalid_goal` or `late`, naming the field.
    """
    joints = config.joint_count
    positions, velocities = goal.positions, goal.velocities
    if positions is None:
        positions = primitive.goal.positions.tolist()
        velocities = primitive.goal.velocities.tolist() if velocities is None else velocities
    try:
        return MotionRequest(
            start=origin.boundary,
            goal=Boundary(
                _vector(positions, joints, "positions"),
                _vector(velocities, joints, "velocities"),
                _partial(goal.accelerations, joints, "accelerations"),
            ),
            duration=_duration(goal, primitive, config, origin),
            limits=_limits(goal.limits, config),
            waypoints=tuple(
                Waypoint(
                    waypoint.time_from_start,
                    _partial(waypoint.positions, joints, f"waypoints[{index}].positions"),
                    _partial(waypoint.velocities, joints, f"waypoints[{index}].velocities"),
                )
                for index, waypoint in enumerate(goal.waypoints)
            ),
            rest_fraction=goal.rest_fraction,
            tail=goal.tail,
        )
    except InvalidMotion as error:
        raise _invalid(error) from None


def check_goal(goal: m.Goal, primitive: Primitive, config: RobotConfig) -> None:
    """Refuse with `invalid_goal` what contradicts itself, whatever the start."""
    if primitive.joint_count != config.joint_count:
        sentence = (
            f"primitive {goal.primitive!r} moves {primitive.joint_count} joints, the arm has {config.joint_count}"
        )
        raise Refusal("invalid_goal", sentence, field="primitive")
    _check_supported(goal)
    if goal.duration is not None and goal.arrival_time is not None:
        raise Refusal("invalid_goal", "give duration or arrival_time, not both", field="arrival_time")
    if goal.duration is not None and not 0 < goal.duration <= MAX_PLAN_S:
        sentence = f"duration is {goal.duration} s; it must be greater than 0 and at most {MAX_PLAN_S} s"
        raise Refusal("invalid_goal", sentence, field="duration")
    if goal.start is not None and not goal.plan_only:
        sentence = "start is for plan_only goals; a motion that is played continues the reference"
        raise Refusal("invalid_goal", sentence, field="start")
    if goal.tail == "coast" and not goal.plan_only:
        raise Refusal("invalid_goal", "tail 'coast' is for plan_only goals; an arm must come to rest", field="tail")
    if goal.lease and not goal.client_id:
        raise Refusal("invalid_goal", "a lease needs the client_id that holds the token", field="client_id")
    if len(goal.client_id) > MAX_ID:
        sentence = f"client_id has {len(goal.client_id)} characters; it must have at most {MAX_ID}"
        raise Refusal("invalid_goal", sentence, field="client_id")
    if goal.goal_id is not None and not 0 < len(goal.goal_id) <= MAX_ID:
        raise Refusal("invalid_goal", f"goal_id must have 1 to {MAX_ID} characters", field="goal_id")
    if goal.method == "dmp" and goal.start is not None and goal.start.accelerations is not None:
        sentence = "start.accelerations cannot be met by a DMP; leave them out or use method 'qp'"
        raise Refusal("invalid_goal", sentence, field="start.accelerations")


def _check_supported(goal: m.Goal) -> None:
    """Refuse with `invalid_goal` what the contract has and this planner does not do yet."""
    asked = {
        "revises": goal.revises is not None,
        "alternatives": bool(goal.alternatives),
        "fastest": goal.fastest,
        "follow_through": goal.follow_through != 0,
        "place_time": goal.place_time is not None,
        "method": goal.method == "gaussian",
    }
    for field in (field for field, is_asked in asked.items() if is_asked):
        raise Refusal("invalid_goal", f"{field} {getattr(goal, field)!r:.80} is not supported yet", field=field)


def too_long(goal: m.Goal, duration: float, total_duration: float) -> Refusal:
    """Return the refusal of a motion that takes more than a plan may, together with its stop."""
    field = "duration" if goal.arrival_time is None else "arrival_time"
    sentence = (
        f"the motion takes {duration:.3f} s and its stop {total_duration - duration:.3f} s, together more than the "
        f"{MAX_PLAN_S} s of the longest plan; end it sooner or slower"
    )
    return Refusal("invalid_goal", sentence, field=field)


def not_executed(refusal: Refusal) -> Refusal:
    """Return the refusal of a goal whose plan does not fit `execute`."""
    return Refusal("invalid_goal", f"the plan cannot be executed: {refusal.message}", field="duration")


def start_boundary(start: m.Start, config: RobotConfig) -> Boundary:
    """Return the start that a plan-only goal names.

    Raises:
        Refusal: `bad_message` for a wrong length.
    """
    joints = config.joint_count
    return Boundary(
        _vector(start.positions, joints, "start.positions"),
        _vector(start.velocities, joints, "start.velocities"),
        _partial(start.accelerations, joints, "start.accelerations"),
    )


def refusal_of(error: MotionError, config: RobotConfig) -> Refusal:
    """Return the refusal that says what `error` says, joints by name."""
    if isinstance(error, InvalidMotion):
        return _invalid(error)
    index = getattr(error, "joint", 0)
    joint = config.joint_names[index]
    sentence = str(error).replace(f"joint {index}", joint, 1)
    match error:
        case LimitExceeded():
            detail = {"quantity": error.quantity, "value": error.value, "bound": error.bound}
            return Refusal("limit", sentence, joint=joint, **detail)
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
        case SolverFailed():
            return Refusal("solver_failed", sentence, joint=joint, status=error.status)
    raise error


def _duration(goal: m.Goal, primitive: Primitive, config: RobotConfig, origin: Origin) -> float:
    """The duration in whole ticks: rounded up, or to the nearest for an arrival time."""
    if goal.arrival_time is None:
        wanted = goal.duration if goal.duration is not None else primitive.duration
        if wanted > MAX_PLAN_S:
            sentence = f"the demonstration takes {wanted:.3f} s; give a duration of at most {MAX_PLAN_S} s"
            raise Refusal("invalid_goal", sentence, field="duration")
        return math.ceil(wanted * config.rate_hz - ROUNDING) / config.rate_hz
    left = goal.arrival_time - origin.time
    if left > MAX_PLAN_S + config.tick / 2:
        sentence = f"arrival_time {goal.arrival_time} s lies more than {MAX_PLAN_S} s ahead of {origin.time:.3f} s"
        raise Refusal("invalid_goal", sentence, field="arrival_time")
    if left <= config.tick / 2:
        sentence = f"arrival_time {goal.arrival_time} s has passed: the motion can begin at {origin.time:.3f} s"
        raise Refusal("late", sentence, goal_id=goal.goal_id)
    return round(left * config.rate_hz) / config.rate_hz


def _limits(asked: m.GoalLimits | None, config: RobotConfig) -> Limits:
    """The tighter of the robot's limits and the goal's."""
    if asked is None:
        return config.limits
    joints, free = config.joint_count, (-math.inf, math.inf)
    ranges = asked.positions if asked.positions is not None else [None] * joints
    check_lengths(joints, **{"limits.positions": ranges})
    bounds = [
        np.nan_to_num(_partial(getattr(asked, name), joints, f"limits.{name}"), nan=math.inf)
        for name in ("velocities", "accelerations", "jerks")
    ]
    return config.limits.tightened(Limits(np.array([pair or free for pair in ranges]), *bounds))


def _vector(values: list[float] | None, joints: int, field: str) -> np.ndarray:
    if values is None:
        return np.zeros(joints)
    check_lengths(joints, **{field: values})
    return np.array(values, dtype=float)


def _partial(values: list[float | None] | None, joints: int, field: str) -> np.ndarray:
    """A vector in which null is NaN: free."""
    if values is None:
        return np.full(joints, math.nan)
    check_lengths(joints, **{field: values})
    return np.array([math.nan if value is None else value for value in values])


def _invalid(error: InvalidMotion) -> Refusal:
    field = error.field.removeprefix("goal.")
    return Refusal("invalid_goal", f"{field}: {error.message}", field=field)
