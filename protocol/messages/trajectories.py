"""Motions, as the planner sends them to the controller and publishes them."""

from typing import Annotated

from msgspec import UNSET, Meta, Struct, UnsetType, field

from protocol.messages.base import (
    Clearance,
    Message,
    Names,
    Number,
    PartialVector,
    PlanLimits,
    Stamps,
    Tolerance,
    Waypoint,
)

MAX_PIECES = 4096
"""Largest number of pieces of one motion."""
COEFFICIENTS = 6
"""Coefficients of one piece and joint: degree 5 or less."""

Breaks = Annotated[list[Number], Meta(max_length=MAX_PIECES + 1)]


class Pieces(Struct, forbid_unknown_fields=True, kw_only=True):
    """A motion as m polynomials one after the other, each of degree 5 or less in every joint.

    Attributes:
        breaks: the m + 1 times at which the pieces begin and the last one ends, s from `start_time`, not decreasing,
            the first 0; 1 to 4096 pieces
        coefficients: array of m × joints × 6, of the powers 0 to 5 of the time since the piece began: rad, rad/s,
            rad/s², …
    """

    breaks: Breaks
    coefficients: bytes


class Motion(Message, kw_only=True):
    """Fields of a motion, in a request and as published.

    Attributes:
        goal_id: of the goal
        client_id: name of the client, at most 128 printable characters
        lease: as in the [Goal](#goal)
        preempt: as in the [Goal](#goal)
        epoch: of the controller when the plan was made; a plan with an older epoch is refused as `superseded`
        joint_names: in the controller's order
        start_time: of sample 0, rounded to the nearest tick
        dt: time between samples: 1 / `rate_hz`; in a reply or publication of a motion over 20 s, a multiple of that
        count: number of samples; with `pieces` alone: ticks from 0 to the first one at or after their end
        hit_index: index of the sample at the goal, or of the nearest one
        stamps: of the stages reached so far
        pieces: the motion as polynomials, left out if it consists of samples
        tolerance: as in the [Goal](#goal), left out if the goal has none
    """

    goal_id: str
    client_id: str = ""
    lease: bool = False
    preempt: bool = True
    epoch: int
    joint_names: Names
    start_time: Number
    dt: Number
    count: int
    hit_index: int
    stamps: Stamps = Stamps()
    # Left out, not null: clients of the first version refuse a trajectory with a field that they do not know.
    pieces: Pieces | UnsetType | None = UNSET
    tolerance: Tolerance | UnsetType | None = UNSET


class Trajectory(Motion, forbid_unknown_fields=True, kw_only=True):
    """A motion from `start_time` through the goal to rest.

    A request has either the three matrices or `pieces`. Pieces are smaller, and the controller checks them for all
    times instead of at samples: inside the limits; positions, velocities and accelerations continuous at the breaks.
    Samples and pieces end at rest.

    Attributes:
        positions: matrix of `count` × joints
        velocities: matrix of `count` × joints
        accelerations: matrix of `count` × joints
    """

    positions: bytes | None = None
    velocities: bytes | None = None
    accelerations: bytes | None = None


class Plan(Motion, kw_only=True):
    """An accepted trajectory, with the goal's conditions.

    Attributes:
        positions: matrix of `count` × joints
        velocities: matrix of `count` × joints
        accelerations: matrix of `count` × joints
        primitive: name of the imitated primitive
        revises: goal_id of the motion that it corrects, null for none
        phase: phase of the demonstration at which it began
        limits: of the plan
        waypoints: of the goal
        torque_use: as in the report
        clearance: as in the report
        demonstration: the demonstrated positions from `phase` on, warped to the duration: matrix of (`hit_index` + 1) ×
            joints
    """

    positions: bytes
    velocities: bytes
    accelerations: bytes
    primitive: str
    revises: str | None = None
    phase: Number = 0.0
    limits: PlanLimits
    waypoints: list[Waypoint] = field(default_factory=list)
    torque_use: PartialVector | None = None
    clearance: Clearance | None = None
    demonstration: bytes = b""
