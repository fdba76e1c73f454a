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
    """What a goal may say besides its primitive; what is left out is as the wire contract has it (docs/protocol.md).

    Attributes:
        positions: Where each joint ends, rad; by default where the primitive ends.
        velocities: With which velocity, rad/s; by default zero, or as demonstrated where `positions` is left out.
        accelerations: With which acceleration, rad/s², None where free; by default free unless the arm ends at rest.
        tool: Where the tool ends and how it moves there, made by `tool`, instead of positions and velocities.
        alternatives: Up to 256 further ends; the feasible one that imitates best is played.
        duration: From the start to the goal, s; by default as long as the demonstration.
        arrival_time: When to be at the goal, s on the robot's clock, instead of a duration.
        fastest: In the shortest duration inside the limits, instead of a given one.
        revises: The goal_id of a motion under way that this one corrects; `GoalHandle.correct` sets it.
        goal_id: Names the motion; by default the planner makes one.
        start: Where a motion begins that is only planned; by default where the arm will be.
        waypoints: Places or velocities on the way, of the joints or of the tool.
        limits: Tighter limits than the robot's own.
        tolerance: Largest error at the hit; where it is larger the outcome is `missed`. By default the robot's own.
        rest_fraction: Final part of the duration without acceleration, 0 to 0.99.
        place_time: Keep the demonstrated places but for about this long at both ends, s, at least 0.05.
        follow_through: Keep the final velocity this long after the goal, s, at most 0.5.
        checks: What the plan is checked for besides its limits: by default collisions and torques.
        tail: `stop` after the goal; `coast` on where the motion is only planned.
        method: `qp`; `gaussian` (the paper's) or `dmp` (a movement primitive) to compare it with.
        include_trajectory: Reply with the planned trajectory, for `samples` or `execute`.
        preempt: Take the place of a motion that runs; False: be refused as `busy` while there is one.
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
    """Return where a goal or waypoint has the tool's site, in the world frame.

    Args:
        position: (3,), m.
        axis: (3,), direction in which the tool's z axis points; by default any.
        orientation: (4,), quaternion w, x, y, z, instead of an axis; by default any.
        velocity: (3,), m/s; by default at rest.
        angular_velocity: (3,), rad/s; by default any beside a velocity.

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
    """Return a vector in space as a message has it.

    Raises:
        ValueError: it has not three numbers.
    """
    return _numbers(name, vector, 3)


def _numbers(name: str, vector: Vector, count: int) -> Any:
    values = tuple(map(float, vector))
    if len(values) != count:
        what = "a vector in space" if count == 3 else "a quaternion"
        raise ValueError(f"{name} has {len(values)} numbers; {what} has {count}")
    return values
