"""The fields of a goal as keyword arguments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypedDict

from protocol import messages as m

if TYPE_CHECKING:
    import numpy as np

Vector: TypeAlias = "Sequence[float] | np.ndarray"
"""One number a joint, in the order of `description().joint_names`: a list, a tuple or an array."""
PartialVector: TypeAlias = "Sequence[float | None] | np.ndarray"
"""One number a joint, or None where the joint is free."""


class GoalFields(TypedDict, total=False):
    """Fields of a goal besides its primitive; the wire contract (docs/protocol.md) gives the defaults.

    Attributes:
        positions: Joint positions at the goal, rad; by default those of the primitive's end.
        velocities: Joint velocities at the goal, rad/s; by default zero, or without `positions` as demonstrated.
        accelerations: Joint accelerations at the goal, rad/s², None for a free joint; by default free unless the arm
            ends at rest.
        tool: Pose and velocity of the tool at the goal, returned by `tool`, instead of positions and velocities.
        alternatives: Up to 256 other allowed ends; the feasible one that imitates best is played.
        duration: Time from the start to the goal, s; by default the demonstration's.
        arrival_time: Time at the goal, s on the robot's clock, instead of a duration.
        fastest: Use the shortest duration inside the limits, instead of a given one.
        revises: The goal_id of a running motion that this goal corrects; `GoalHandle.correct` sets it.
        goal_id: Name of the motion; by default the planner chooses one.
        start: Start of a motion that is only planned; by default the reference at the motion's start time.
        waypoints: Positions or velocities on the way, of the joints or of the tool.
        limits: Tighter limits than the robot's.
        tolerance: Largest error at the hit; beyond it the outcome is `missed`. By default the robot's.
        rest_fraction: Final fraction of the duration without acceleration, 0 to 0.99.
        place_time: Deviate from the demonstrated positions only within about this time of both ends, s, at least 0.05;
            by default a different start or goal changes the whole motion.
        follow_through: Keep the final velocity this long after the goal, s, at most 0.5.
        checks: Checks of the plan besides its limits; by default collisions and torques.
        tail: After the goal: `stop`, or `coast` for a motion that is only planned.
        method: `qp`, or for comparison `gaussian` (the paper's formulation) or `dmp` (a movement primitive).
        include_trajectory: Reply with the planned trajectory, for `samples` or `execute`.
        preempt: Replace a running motion; False: the goal is refused as `busy` while one runs.
    """

    positions: Vector | None
    velocities: Vector | None
    accelerations: PartialVector | None
    tool: m.ToolGoal | None
    alternatives: Sequence[m.Alternative]
    duration: float | None
    arrival_time: float | None
    fastest: bool
    revises: str | None
    goal_id: str | None
    start: m.Start | None
    waypoints: Sequence[m.Waypoint]
    limits: m.GoalLimits | None
    tolerance: m.Tolerance | None
    rest_fraction: float
    place_time: float | None
    follow_through: float
    checks: m.Checks
    tail: Literal["stop", "coast"]
    method: Literal["qp", "gaussian", "dmp"]
    include_trajectory: bool
    preempt: bool


def tool(
    position: Vector,
    *,
    axis: Vector | None = None,
    orientation: Vector | None = None,
    velocity: Vector | None = None,
    angular_velocity: Vector | None = None,
) -> m.ToolGoal:
    """Return a goal or waypoint of the tool's site, in the world frame.

    Args:
        position: (3,), m.
        axis: (3,), direction of the tool's z axis; by default free.
        orientation: (4,), quaternion w, x, y, z, instead of an axis; by default free.
        velocity: (3,), m/s; by default zero.
        angular_velocity: (3,), rad/s; by default free if a velocity is given.

    Raises:
        ValueError: a vector has another length.
    """
    given: dict[str, Any] = {
        "axis": axis,
        "velocity": velocity,
        "angular_velocity": angular_velocity,
        "position": position,
        "orientation": orientation,
    }
    for name, vector in given.items():
        if vector is not None:
            given[name] = _numbers(name, vector, 4 if name == "orientation" else 3)
    return m.ToolGoal(**given)


def triple(name: str, vector: Vector) -> tuple[float, float, float]:
    """Return a vector in space as a message field.

    Raises:
        ValueError: it does not have three numbers.
    """
    return _numbers(name, vector, 3)


def _numbers(name: str, vector: Vector, count: int) -> Any:
    values = tuple(map(float, vector))
    if len(values) != count:
        what = "a vector in space" if count == 3 else "a quaternion"
        raise ValueError(f"{name} has {len(values)} numbers; {what} has {count}")
    return values
