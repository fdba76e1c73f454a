"""Convert a goal message to a motion request."""

import math
from dataclasses import dataclass

import numpy as np

from motion.alternatives import End
from motion.errors import InvalidMotion
from motion.limits import Limits
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest, Waypoint
from protocol import messages as m
from protocol.codec import check_lengths
from protocol.errors import Refusal
from protocol.topics import MAX_PLAN_S
from robot.conversions import QUANTITY_OF, unit_of
from robot.description import RobotConfig
from services.planner.corrections import Correction, Corrections
from services.planner.refusals import invalid

ROUNDING = 1e-9

SMALLEST_LIMIT = 1e-6
"""Smallest limit of velocity, acceleration and jerk that a goal may ask for, in their units."""

REPEATS_START = 0.01
"""Largest distance (rad, rad/s) from the start of a waypoint at 0 s that repeats it, which many clients send."""


@dataclass(frozen=True, slots=True, eq=False)
class Origin:
    """State and time at the start of a motion.

    `epoch`: the controller's, 0 without a controller. `correction`: set if the motion corrects a running one.
    """

    time: float
    epoch: int
    boundary: Boundary
    correction: Correction | None = None


def motion_request(goal: m.Goal, primitive: Primitive, config: RobotConfig, origin: Origin) -> MotionRequest:
    """Return the motion request of a goal that has passed `check_goal`.

    Raises:
        Refusal: `bad_message`, `invalid_goal` or `late`, naming the field.
    """
    joints = config.joint_count
    try:
        return MotionRequest(
            start=origin.boundary,
            goal=_goal_boundary(goal, primitive, joints),
            duration=planned_duration(goal, primitive, config, origin),
            limits=limits_of(goal.limits, config),
            waypoints=_waypoints(goal.waypoints, joints, origin.boundary),
            rest_fraction=goal.rest_fraction,
            tail=goal.tail,
            follow_through=goal.follow_through,
            place_time=goal.place_time,
            phase=origin.correction.phase if origin.correction else 0.0,
        )
    except InvalidMotion as error:
        raise invalid(error) from None


def ends(
    goal: m.Goal, primitive: Primitive, request: MotionRequest, config: RobotConfig, origin: Origin
) -> tuple[dict[int, End], dict[int, Refusal]]:
    """Return a goal's ends by index, 0 its own and then the alternatives, and the refusals of those that are late.

    Raises:
        Refusal: `invalid_goal`, naming the field.
    """
    own, joints = request.goal, config.joint_count
    found: dict[int, End] = {}
    late: dict[int, Refusal] = {}
    try:
        found[0] = End(own, duration_of(goal, primitive, config, origin))
    except Refusal as refusal:
        if refusal.code != "late":
            raise
        late[0] = refusal
    for index, end in enumerate(goal.alternatives, 1):
        boundary = Boundary(
            own.positions if end.positions is None else _vector(end.positions, joints, "positions"),
            own.velocities if end.velocities is None else _vector(end.velocities, joints, "velocities"),
            own.accelerations if end.accelerations is None else _partial(end.accelerations, joints, "accelerations"),
        )
        duration = request.duration
        if end.arrival_time is not None:
            field = f"alternatives[{index - 1}].arrival_time"
            try:
                duration = _duration_until(end.arrival_time, goal, config, origin, field)
            except Refusal as refusal:
                if refusal.code != "late":
                    raise
                late[index] = refusal
                continue
        elif end.duration is not None:
            duration = _whole_ticks(end.duration, config)
        elif 0 in late:
            late[index] = late[0]
            continue
        found[index] = End(boundary, duration)
    return found, late


def origin_of(goal: m.Goal, reference: m.Reference | None, corrections: Corrections, config: RobotConfig) -> Origin:
    """Return the origin of the motion: the goal's start, the future reference, or without one home at rest.

    Raises:
        Refusal: `bad_message` for a start of a wrong length, and all refusals of `Corrections.correction`.
    """
    at, epoch = (reference.time, reference.epoch) if reference else (0.0, 0)
    joints, start = config.joint_count, goal.start
    if start is not None:
        boundary = Boundary(
            _vector(start.positions, joints, "start.positions"),
            _vector(start.velocities, joints, "start.velocities"),
            _partial(start.accelerations, joints, "start.accelerations"),
        )
        return Origin(at, epoch, boundary)
    if reference is None:
        return Origin(at, epoch, Boundary(config.home, np.zeros(joints), np.zeros(joints)))
    vectors = (np.array(v) for v in (reference.positions, reference.velocities, reference.accelerations))
    return Origin(at, epoch, Boundary(*vectors), corrections.correction(goal, reference))


def _goal_boundary(goal: m.Goal, primitive: Primitive, joints: int) -> Boundary:
    """Return the goal's end; without positions, the primitive's end.

    The default of its velocities is then the demonstrated ones.
    """
    positions, velocities = goal.positions, goal.velocities
    if positions is None:
        positions = primitive.goal.positions.tolist()
        velocities = primitive.goal.velocities.tolist() if velocities is None else velocities
    return Boundary(
        _vector(positions, joints, "positions"),
        _vector(velocities, joints, "velocities"),
        _partial(goal.accelerations, joints, "accelerations"),
    )


def _waypoints(asked: list[m.Waypoint], joints: int, start: Boundary) -> tuple[Waypoint, ...]:
    """Return the waypoints, without one at 0 s that repeats the start."""
    found = []
    for index, waypoint in enumerate(asked):
        positions = _partial(waypoint.positions, joints, f"waypoints[{index}].positions")
        velocities = _partial(waypoint.velocities, joints, f"waypoints[{index}].velocities")
        apart = np.abs(np.concatenate([positions - start.positions, velocities - start.velocities]))
        if waypoint.time_from_start == 0 and np.nanmax(apart, initial=0) <= REPEATS_START and waypoint.positions:
            continue
        found.append(Waypoint(waypoint.time_from_start, positions, velocities))
    return tuple(found)


def duration_of(goal: m.Goal, primitive: Primitive, config: RobotConfig, origin: Origin) -> float:
    """Return the duration in whole ticks: rounded up, or to the nearest for an arrival time.

    Raises:
        Refusal: `invalid_goal` or `late`, naming the field.
    """
    if goal.arrival_time is not None:
        return _duration_until(goal.arrival_time, goal, config, origin)
    if goal.duration is None and origin.correction is not None:
        return _duration_until(origin.correction.hit_time, goal, config, origin)
    wanted = goal.duration if goal.duration is not None else primitive.duration
    if wanted > MAX_PLAN_S:
        sentence = f"the demonstration takes {wanted:.3f} s; give a duration of at most {MAX_PLAN_S} s"
        raise Refusal("invalid_goal", sentence, field="duration")
    return _whole_ticks(wanted, config)


def planned_duration(goal: m.Goal, primitive: Primitive, config: RobotConfig, origin: Origin) -> float:
    """Return the duration of the goal; if it is late but has alternatives, that of the demonstration.

    Raises:
        Refusal: as `duration_of`.
    """
    try:
        return duration_of(goal, primitive, config, origin)
    except Refusal as refusal:
        if refusal.code != "late" or not goal.alternatives:
            raise
        return min(primitive.duration, MAX_PLAN_S)


def _whole_ticks(duration: float, config: RobotConfig) -> float:
    return math.ceil(duration * config.rate_hz - ROUNDING) / config.rate_hz


def _duration_until(
    arrival_time: float, goal: m.Goal, config: RobotConfig, origin: Origin, field: str = "arrival_time"
) -> float:
    """Return the time from the origin to `arrival_time`, to the nearest tick; `field` is the field of that time."""
    left = arrival_time - origin.time
    if left > MAX_PLAN_S + config.tick / 2:
        sentence = f"{field} {arrival_time} s lies more than {MAX_PLAN_S} s ahead of {origin.time:.3f} s"
        raise Refusal("invalid_goal", sentence, field=field)
    if left <= config.tick / 2:
        sentence = f"{field} {arrival_time} s has passed: the motion can begin at {origin.time:.3f} s"
        raise Refusal("late", sentence, goal_id=goal.goal_id)
    return round(left * config.rate_hz) / config.rate_hz


def limits_of(asked: m.GoalLimits | None, config: RobotConfig) -> Limits:
    """Return the tighter of the robot's limits and the goal's.

    Raises:
        Refusal: `bad_message` for a wrong number of joints.
        InvalidMotion: a range is empty.
    """
    if asked is None:
        return config.limits
    joints, free = config.joint_count, (-math.inf, math.inf)
    ranges = asked.positions if asked.positions is not None else [None] * joints
    check_lengths(joints, **{"limits.positions": ranges})
    bounds = [
        np.nan_to_num(_partial(getattr(asked, name), joints, f"limits.{name}"), nan=math.inf)
        for name in ("velocities", "accelerations", "jerks")
    ]
    _check_limits(asked, config)
    return config.limits.tightened(Limits(np.array([pair or free for pair in ranges]), *bounds))


def _check_limits(asked: m.GoalLimits, config: RobotConfig) -> None:
    """Refuse limits that no value is inside of, with their joint."""
    joints = list(zip(config.joint_names, config.slides, strict=True))
    for (name, slides), pair, (low, high) in zip(joints, asked.positions or (), config.limits.positions, strict=False):
        if pair is None or max(pair[0], low) < min(pair[1], high):
            continue
        unit = unit_of("position", slides)
        cure = f"the robot's own are {low:g} to {high:g} {unit}; the two must overlap"
        if not pair[0] < pair[1]:
            cure = "send the lower one first"
        sentence = f"limits.positions of {name} are {pair[0]:g} to {pair[1]:g} {unit}; {cure}"
        raise Refusal("invalid_goal", sentence, field="limits.positions")
    for quantity in ("velocities", "accelerations", "jerks"):
        for (name, slides), bound in zip(joints, getattr(asked, quantity) or (), strict=False):
            if bound is not None and bound < SMALLEST_LIMIT:
                field, unit = f"limits.{quantity}", unit_of(QUANTITY_OF[quantity], slides)
                wanted = f"it must be at least {SMALLEST_LIMIT:g} {unit}, or null: the robot's own"
                raise Refusal("invalid_goal", f"{field} of {name} is {bound:g} {unit}; {wanted}", field=field)


def _vector(values: list[float] | None, joints: int, field: str) -> np.ndarray:
    if values is None:
        return np.zeros(joints)
    check_lengths(joints, **{field: values})
    return np.array(values, dtype=float)


def _partial(values: list[float | None] | None, joints: int, field: str) -> np.ndarray:
    """Return a vector with NaN, which means free, for null."""
    if values is None:
        return np.full(joints, math.nan)
    check_lengths(joints, **{field: values})
    return np.array([math.nan if value is None else value for value in values])
