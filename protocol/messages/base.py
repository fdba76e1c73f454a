"""Types and messages that several messages share."""

import sys
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct

MAX_JOINTS = 64
"""More than any arm has."""
Number = Annotated[float, Meta(ge=-sys.float_info.max, le=sys.float_info.max)]
"""A finite number: NaN fails both bounds."""
Vector = list[Number]
PartialVector = list[Number | None]
Range = tuple[Number, Number]
Joints = Annotated[dict[str, Number], Meta(max_length=MAX_JOINTS)]
"""Values of joints by name."""
Triple = tuple[Number, Number, Number]
Quaternion = tuple[Number, Number, Number, Number]
Names = Annotated[list[str], Meta(max_length=MAX_JOINTS)]
"""Names of joints."""
Outcome = Literal["running", "succeeded", "missed", "preempted", "canceled", "aborted"]
Mode = Literal["holding", "tracking", "stopping", "fault"]
Clock = Literal["realtime", "stepped", "paced"]
Condition = Literal["ready", "braking", "reflex", "user_stopped", "guiding", "not_ready"]
DriveMode = Literal["torque", "position", "teach"]
TorqueSource = Literal["commanded", "measured"]


class Message(Struct, kw_only=True):
    """Base of every message: the version of the contract, 1."""

    version: Literal[1] = 1


class Request(Message, forbid_unknown_fields=True):
    """Base of every request; unknown fields are refused."""


class Empty(Request, kw_only=True):
    """The request without fields, `{}`; an absent body counts as one."""


class Stamps(Struct, frozen=True):
    """Times at which a goal reached each stage, Unix ns; null for stages not reached.

    Attributes:
        requested: the planner received it
        planned: the plan was ready
        accepted: the controller took the plan
        first_command: the controller sent the plan's first command
    """

    requested: int | None = None
    planned: int | None = None
    accepted: int | None = None
    first_command: int | None = None


class Point(Struct, kw_only=True):
    """A state of the joints: rad, rad/s."""

    positions: Vector
    velocities: Vector


class ErrorBody(Struct, kw_only=True):
    """The body of every refusal.

    Attributes:
        code: see [codes](#codes)
        message: a sentence that says what is wrong and what would work
        detail: the values in the sentence; its fields depend on the code
    """

    code: str
    message: str
    detail: dict[str, Any]


class ToolGoal(Struct, forbid_unknown_fields=True, kw_only=True):
    """Pose and velocity of the tool's site in the world frame.

    Attributes:
        position: m
        orientation: quaternion w, x, y, z, of any length but 0; null: free
        axis: direction in which the tool's z axis points, of any length but 0; not with `orientation`; null: free
        velocity: m/s, null: zero; in a waypoint free if `angular_velocity` is null too
        angular_velocity: rad/s, null: zero, or free if `velocity` is given
    """

    position: Triple
    orientation: Quaternion | None = None
    axis: Triple | None = None
    velocity: Triple | None = None
    angular_velocity: Triple | None = None


class Tolerance(Struct, forbid_unknown_fields=True, kw_only=True):
    """Largest error at a hit, on any joint; null: the robot's own.

    Attributes:
        positions: rad, > 0
        velocities: rad/s, > 0
    """

    positions: Number | None = None
    velocities: Number | None = None


class Waypoint(Struct, forbid_unknown_fields=True, kw_only=True):
    """Positions or velocities to pass through exactly, at any time, not only on a tick.

    Attributes:
        time_from_start: 0 < time < duration
        positions: null, as a whole or for one joint: free
        velocities: null, as a whole or for one joint: free
        tool: where the tool is, in place of `positions` and `velocities`
    """

    time_from_start: Number
    positions: PartialVector | None = None
    velocities: PartialVector | None = None
    tool: ToolGoal | None = None


class PlanLimits(Struct, kw_only=True):
    """The limits of a plan, the robot's and the goal's combined.

    Attributes:
        positions: [low, high] of each joint, null: no limit
        velocities: largest of either sign, null: no limit
        accelerations: largest of either sign, null: no limit
        jerks: largest of either sign, null: no limit
    """

    positions: list[Range | None]
    velocities: PartialVector
    accelerations: PartialVector
    jerks: PartialVector


class Clearance(Struct, kw_only=True):
    """The smallest distance of the arm from itself and from the scene along a motion.

    Pairs of bodies that are not checked do not count.

    Attributes:
        distance: m, exact to 2 mm or a tenth of it, whichever is larger; from 0.2 m on a lower bound, as exact
        body: body of the arm
        other: body nearest to it; for the world, the geom's name
        time_from_start: time of the smallest distance
    """

    distance: Number
    body: str
    other: str
    time_from_start: Number
