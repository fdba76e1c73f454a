"""Motions on their way from the planner to the controller, and as published."""

from msgspec import Struct, field

from protocol.messages.base import Message, Names, Number, PartialVector, Range, Stamps, Waypoint


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
        dt: 1 / `rate_hz`
        count: number of samples
        hit_index: the sample at the goal
        positions: matrix of `count` × joints
        velocities: matrix of `count` × joints
        accelerations: matrix of `count` × joints
        stamps: so far
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
    positions: bytes
    velocities: bytes
    accelerations: bytes
    stamps: Stamps = Stamps()


class Trajectory(Motion, forbid_unknown_fields=True, kw_only=True):
    """A sampled motion from `start_time` through the goal to rest."""


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
        primitive: what it imitates
        limits: it was made under
        waypoints: as asked for
        demonstration: the demonstrated positions, warped to the duration: matrix of (`hit_index` + 1) × joints
    """

    primitive: str
    limits: PlanLimits
    waypoints: list[Waypoint] = field(default_factory=list)
    demonstration: bytes = b""
