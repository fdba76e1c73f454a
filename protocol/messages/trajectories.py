"""Motions on their way from the planner to the controller, and as published."""

from typing import Annotated

from msgspec import UNSET, Meta, Struct, UnsetType, field

from protocol.messages.base import Message, Names, Number, PartialVector, Range, Stamps, Waypoint

MAX_PIECES = 4096
"""Of one motion."""
COEFFICIENTS = 6
"""Of one piece and joint: degree 5 or less."""

Breaks = Annotated[list[Number], Meta(max_length=MAX_PIECES + 1)]


class Pieces(Struct, forbid_unknown_fields=True, kw_only=True):
    """A motion as m polynomials one after the other, each of degree 5 or less in every joint.

    Attributes:
        breaks: the m + 1 times at which the pieces begin and the last one ends, s from `start_time`, not decreasing,
            the first 0; 1 to 4096 pieces
        coefficients: array of m × joints × 6: what the powers 0 to 5 of the time since the piece's begin are multiplied
            with, rad, rad/s, rad/s², …
    """

    breaks: Breaks
    coefficients: bytes


class Motion(Message, kw_only=True):
    """What a trajectory has, as a request and as published.

    Attributes:
        goal_id: the goal it serves
        client_id: whose goal it is, at most 128 characters
        lease: as in the [Goal](#goal)
        preempt: as in the [Goal](#goal)
        epoch: the controller's when the plan was made: a plan made under an older one is `superseded`
        joint_names: in the controller's order
        start_time: of sample 0
        dt: from one sample to the next: 1 / `rate_hz`; in a reply or published, of a motion over 20 s, a multiple of it
        count: number of samples; where only `pieces` are there, of ticks from 0 to the first one at or after their end
        hit_index: the sample at the goal; where samples lie more than a tick apart, the nearest
        stamps: so far
        pieces: the motion at all times, where it is made of polynomials; left out where it is not
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
    # Not null where there are none: the first clients refuse a trajectory with a field that they do not know.
    pieces: Pieces | UnsetType | None = UNSET


class Trajectory(Motion, forbid_unknown_fields=True, kw_only=True):
    """A motion from `start_time` through the goal to rest.

    A request has either the three matrices or `pieces`. Pieces are smaller, and checked for all times instead of at the
    samples: inside the limits, positions, velocities and accelerations without a jump at the breaks, and the last piece
    constant; it may have no length.

    Attributes:
        positions: matrix of `count` × joints
        velocities: matrix of `count` × joints
        accelerations: matrix of `count` × joints
    """

    positions: bytes | None = None
    velocities: bytes | None = None
    accelerations: bytes | None = None


class PlanLimits(Struct, kw_only=True):
    """The limits a plan was made under, the robot's and the goal's together.

    Attributes:
        positions: [low, high] of each joint, null where there is none
        velocities: largest of either sign, null where there is none
        accelerations: largest of either sign, null where there is none
        jerks: largest of either sign, null where there is none
    """

    positions: list[Range | None]
    velocities: PartialVector
    accelerations: PartialVector
    jerks: PartialVector


class Plan(Motion, kw_only=True):
    """A trajectory that was accepted, with what it was made of.

    Attributes:
        positions: matrix of `count` × joints
        velocities: matrix of `count` × joints
        accelerations: matrix of `count` × joints
        primitive: what it imitates
        revises: the goal whose motion it corrects, null for none
        phase: where in the demonstration it began
        limits: it was made under
        waypoints: as asked for
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
    demonstration: bytes = b""
