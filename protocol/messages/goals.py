"""Goals for the planner, and its replies."""

from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, field

from protocol.messages.base import (
    Message,
    Number,
    PartialVector,
    Range,
    Request,
    Tolerance,
    ToolGoal,
    Vector,
    Waypoint,
)
from protocol.messages.reports import Report
from protocol.messages.trajectories import Trajectory

MAX_ALTERNATIVES = 256
"""Largest number of further ends of one goal."""


class Start(Struct, forbid_unknown_fields=True, kw_only=True):
    """The state in which a planned motion begins.

    Attributes:
        positions: of each joint
        velocities: null: zero
        accelerations: null, as a whole or for one joint: free
    """

    positions: Vector
    velocities: Vector | None = None
    accelerations: PartialVector | None = None


class GoalLimits(Struct, forbid_unknown_fields=True, kw_only=True):
    """Tighter limits for one goal; null, as a whole or for one joint: the robot's own.

    Attributes:
        positions: [low, high] of each joint
        velocities: largest of either sign, at least 1e-6
        accelerations: largest of either sign, at least 1e-6
        jerks: largest of either sign, at least 1e-6
    """

    positions: list[Range | None] | None = None
    velocities: PartialVector | None = None
    accelerations: PartialVector | None = None
    jerks: PartialVector | None = None


class Alternative(Struct, forbid_unknown_fields=True, kw_only=True):
    """A further end of a goal; null fields are those of the goal.

    Attributes:
        positions: final position of each joint
        velocities: final velocities
        accelerations: final accelerations; null for one joint: free
        duration: from the start, in place of the goal's `duration` or `arrival_time`
        arrival_time: on the robot's clock, in place of the goal's `duration` or `arrival_time`
    """

    positions: Vector | None = None
    velocities: Vector | None = None
    accelerations: PartialVector | None = None
    duration: Number | None = None
    arrival_time: Number | None = None


class Checks(Struct, forbid_unknown_fields=True, kw_only=True):
    """Checks of a plan and its stop besides the limits.

    Attributes:
        collision: the arm and its tool keep the robot's margin from the arm itself and from the scene
        torque: no joint needs more torque than its limit
    """

    collision: bool = True
    torque: bool = True


Alternatives = Annotated[list[Alternative], Meta(max_length=10 * MAX_ALTERNATIVES)]
"""Up to ten times too many are decoded, so that the planner can explain the refusal."""


class Goal(Request, kw_only=True):
    """Play `primitive` to `positions`.

    Attributes:
        primitive: name of the primitive to imitate
        positions: final position of each joint, null: the primitive's own
        velocities: final velocities, null: zero, or the demonstrated ones if `positions` is null too
        accelerations: final accelerations; null, as a whole or for one joint: free if the final velocity is not zero,
            otherwise zero
        tool: final pose and velocity of the tool, in place of `positions` and `velocities`, also those of
            `alternatives`. Of the postures found, the planner plays the one that imitates best; a correction keeps to
            the posture of the motion that it corrects. The reply's `positions` and `velocities` are those that are
            played
        alternatives: up to 256 further ends. The planner plays the feasible end that imitates best: the least mean
            square of g̈ − τ²d̈, each joint in units of its acceleration limit. If every end is refused, the detail of
            the goal's own refusal has `alternatives: [code, …]`
        duration: from the start, rounded up to a tick; without it and `arrival_time`: the demonstration's
        arrival_time: on the robot's clock, to the nearest tick; not together with `duration`
        fastest: play in the shortest duration found inside the limits; not with `duration`, `arrival_time`, `waypoints`
            or `alternatives`
        revises: correct the motion of this goal_id, or of any later correction of it: imitate what is left of the
            demonstration. Without `duration` and `arrival_time` the hit keeps its time. Refused as `unknown_goal` if
            this planner sent no such motion, `late` if its hit was due before this one can begin, `superseded` if it
            was replaced or stopped before its hit, `invalid_goal` if it plays another primitive
        goal_id: name of the motion in all messages, 1 to 128 printable characters, null: the planner chooses one. The
            same id with the same body returns the first reply and moves nothing; with another body, or after a
            restart of the planner, it is a `duplicate`
        client_id: name of the client, at most 128 printable characters; with a `lease` none of / * $ ? #
        lease: the client holds the liveliness token `alive/client/CLIENT_ID`; its loss cancels the motion, and until
            the motion ends goals of other clients are refused as `not_holder`
        start: null: the reference at the time at which the motion begins; given only with `plan_only`
        waypoints: at least 0.01 of the duration from each other and from the ends
        limits: tighter than the robot's own; where both have a limit, the tighter one holds
        tolerance: largest permitted error at the hit; with a larger one the outcome is `missed`. null: the robot's own
        rest_fraction: final part of the duration with exactly zero acceleration, 0 to 0.99; `accelerations` must then
            be null or 0
        place_time: s of the demonstration, at least 0.05: keep the demonstrated positions, except within about this
            time of an end that differs; null: spread the difference over the whole motion
        follow_through: s, 0 to 0.5: keep the final velocity this long after the goal, then stop; `accelerations` must
            then be null or 0
        checks: false leaves a check out: the plan may then collide, or exceed a torque limit
        tail: after the goal: stop inside the limits, or coast on with the final velocity (only with `plan_only`)
        method: the quadratic program on splines (`qp`), the paper's on Gaussians (`gaussian`), or the dynamic movement
            primitive with which both are compared (`dmp`). Plans of the last two are played only if a check finds them
            inside the limits. They take no `alternatives`, `fastest`, `revises`, `place_time` or `follow_through`;
            `dmp` takes no waypoints, `rest_fraction`, `accelerations` or `start.accelerations` either
        plan_only: plan and reply, but do not move
        include_trajectory: include the samples in the reply
        preempt: replace a motion that is under way; false: refuse the goal as `busy` during a motion
    """

    primitive: str
    positions: Vector | None = None
    velocities: Vector | None = None
    accelerations: PartialVector | None = None
    tool: ToolGoal | None = None
    alternatives: Alternatives = field(default_factory=list)
    duration: Number | None = None
    arrival_time: Number | None = None
    fastest: bool = False
    revises: str | None = None
    goal_id: str | None = None
    client_id: str = ""
    lease: bool = False
    start: Start | None = None
    waypoints: list[Waypoint] = field(default_factory=list)
    limits: GoalLimits | None = None
    tolerance: Tolerance | None = None
    rest_fraction: Number = 0.0
    place_time: Number | None = None
    follow_through: Number = 0.0
    checks: Checks = field(default_factory=Checks)
    tail: Literal["stop", "coast"] = "stop"
    method: Literal["qp", "gaussian", "dmp"] = "qp"
    plan_only: bool = False
    include_trajectory: bool = False
    preempt: bool = True


class GoalReply(Message, kw_only=True):
    """The plan: accepted and about to be played, unless the goal has `plan_only`.

    Attributes:
        goal_id: name of the motion
        start_time: on the robot's clock
        duration: from the start to the goal
        total_duration: from the start to rest
        positions: final positions that are played
        velocities: final velocities that are played
        alternative: the end that is played: 0 is the goal's own, 1 the first of its `alternatives`
        trajectory: with `include_trajectory`: samples; of a motion over 20 s every nth sample, see its `dt`
        report: properties of the plan
    """

    goal_id: str
    start_time: Number
    duration: Number
    total_duration: Number
    positions: Vector = field(default_factory=list)
    velocities: Vector = field(default_factory=list)
    alternative: int = 0
    trajectory: Trajectory | None = None
    report: Report


class Refused(Message, kw_only=True):
    """A goal that the planner refused, published after the reply to its sender.

    A request that is refused before it reaches the planner, because its queue is full or the key has a wildcard, is
    not published. If the body does not decode, only the refusal itself is known.

    Attributes:
        goal_id: as in the goal, or the planner's; null if the body did not decode. Cut to 128 characters, and � for
            what cannot be printed
        client_id: of the goal, may be empty
        primitive: of the goal, empty if it is not known
        code: as in the reply, see [codes](#codes)
        message: as in the reply
        detail: as in the reply
        requested: time at which the planner received it
    """

    goal_id: str | None
    client_id: str
    primitive: str
    code: str
    message: str
    detail: dict[str, Any]
    requested: int
