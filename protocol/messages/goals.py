"""What a client asks of the planner's motions, and the answer."""

from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, field

from protocol.messages.base import Message, Number, PartialVector, Range, Request, Vector, Waypoint
from protocol.messages.trajectories import Trajectory

MAX_ALTERNATIVES = 256
"""Further ends of one goal."""


class Start(Struct, forbid_unknown_fields=True, kw_only=True):
    """Where a planned motion begins.

    Attributes:
        positions: of each joint
        velocities: null: zero
        accelerations: null, whole or for one joint: free
    """

    positions: Vector
    velocities: Vector | None = None
    accelerations: PartialVector | None = None


class GoalLimits(Struct, forbid_unknown_fields=True, kw_only=True):
    """Tighter limits for one goal; null, whole or for one joint, means the robot's own.

    Attributes:
        positions: [low, high] of each joint
        velocities: largest of either sign, > 0
        accelerations: largest of either sign, > 0
        jerks: largest of either sign, > 0
    """

    positions: list[Range | None] | None = None
    velocities: PartialVector | None = None
    accelerations: PartialVector | None = None
    jerks: PartialVector | None = None


class Alternative(Struct, forbid_unknown_fields=True, kw_only=True):
    """A further end of a goal; what is null is as in the goal.

    Attributes:
        positions: where each joint ends
        velocities: with which velocity
        accelerations: with which acceleration; null for one joint: free
        duration: from the start, in place of the goal's `duration` or `arrival_time`
        arrival_time: on the robot's clock, in place of the goal's `duration` or `arrival_time`
    """

    positions: Vector | None = None
    velocities: Vector | None = None
    accelerations: PartialVector | None = None
    duration: Number | None = None
    arrival_time: Number | None = None


Alternatives = Annotated[list[Alternative], Meta(max_length=10 * MAX_ALTERNATIVES)]
"""The planner says it better where there are only ten times too many."""


class Goal(Request, kw_only=True):
    """Play `primitive` to `positions`.

    Attributes:
        primitive: what to imitate
        positions: where each joint ends, null: where the primitive ends
        velocities: with which velocity, null: zero, or the demonstrated one where `positions` is null too
        accelerations: with which acceleration; null, whole or for one joint: free where the final velocity is not zero,
            zero where it is
        alternatives: up to 256 further ends; of this one and those the feasible one is played that imitates best: the
            least mean square of g̈ − τ²d̈, each joint in units of its acceleration limit. Where all are refused, the
            detail of this one's refusal has `alternatives: [code, …]`
        duration: from the start, rounded up to a tick; without it and `arrival_time` as long as the demonstration
        arrival_time: on the robot's clock, to the nearest tick; not together with `duration`
        fastest: the shortest duration inside the limits; not with `duration` or `arrival_time`
        revises: correct the motion of this goal_id, also where it was corrected since: imitate what is left of the
            demonstration. Without `duration` and `arrival_time` the hit keeps its time. `unknown_goal` where that
            motion is not under way, `late` where its hit has passed when this one begins, `superseded` where another
            motion replaced it, `invalid_goal` where it is another primitive's
        goal_id: names the motion in everything that follows, 1 to 128 characters, null: made by the planner; the same
            one with the same body answers as the first did and moves nothing, with another body it is `duplicate`
        client_id: whose goal it is, at most 128 characters
        lease: the client holds the liveliness token `alive/client/CLIENT_ID`, its loss cancels the motion, and until
            the end other clients' goals get `not_holder`
        start: null: go on from where everything accepted so far will have the arm; given only with `plan_only`
        waypoints: places to meet on the way, 0.01 of the duration or more from each other and from the ends
        limits: tighter than the robot's own; where both say something the tighter holds
        rest_fraction: final part of the duration with exactly zero acceleration, 0 ≤ ρ < 1; `accelerations` must then
            be null or 0
        place_time: s of the demonstration, 0.05 or more: keep the demonstrated places, but for about this long at each
            end, where the start or goal differs; null: spread the difference over the whole motion
        follow_through: s, 0 to 0.5: keep the final velocity this long after the goal, then stop; `accelerations` must
            then be null or 0
        tail: after the goal: stop inside the limits, or coast on with the final velocity (only with `plan_only`)
        method: the quadratic program on splines (`qp`), the same on Gaussians as in the paper (`gaussian`), or the
            movement primitive that both are compared with (`dmp`). The last two have no certificate, their limits are
            checked on their samples; `dmp` takes no waypoints, `rest_fraction`, `accelerations` or
            `start.accelerations`
        plan_only: reply without moving
        include_trajectory: reply with the samples
        preempt: take the place of a motion that runs; false: `busy` while there is one
    """

    primitive: str
    positions: Vector | None = None
    velocities: Vector | None = None
    accelerations: PartialVector | None = None
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
    rest_fraction: Number = 0.0
    place_time: Number | None = None
    follow_through: Number = 0.0
    tail: Literal["stop", "coast"] = "stop"
    method: Literal["qp", "gaussian", "dmp"] = "qp"
    plan_only: bool = False
    include_trajectory: bool = False
    preempt: bool = True


class FinalError(Struct, kw_only=True):
    """How far the plan ends from what was asked, recomputed from the solution: rad, rad/s."""

    positions: Vector
    velocities: Vector


class ActiveLimit(Struct, kw_only=True):
    """A limit that shapes the plan.

    Attributes:
        joint: its name
        quantity: position, velocity, acceleration or jerk
        time_from_start: when
    """

    joint: str
    quantity: str
    time_from_start: Number


class Extremes(Struct, kw_only=True):
    """[least, greatest] value of each joint over the whole motion, between samples included."""

    positions: list[Range]
    velocities: list[Range]
    accelerations: list[Range]
    jerks: list[Range]


class Margin(Struct, kw_only=True):
    """How far each joint stays from the nearest limit; null where there is none."""

    positions: PartialVector
    velocities: PartialVector
    accelerations: PartialVector
    jerks: PartialVector


class Distance(Struct, kw_only=True):
    """How far two curves are apart over the whole motion, rad a joint.

    Attributes:
        rms: root mean square
        max: largest
    """

    rms: Vector
    max: Vector


class Deviation(Struct, kw_only=True):
    """How far the plan is from where it might have been.

    Attributes:
        from_demonstration: from the demonstrated positions, in the motion's own time
        by_limits: from the same plan without limits
    """

    from_demonstration: Distance
    by_limits: Distance


class Report(Struct, kw_only=True):
    """What the planner knows of its plan, recomputed from the solution.

    Attributes:
        imitation_rms: root mean square of g̈ − τ²d̈ over the motion, rad/s² a joint
        deviation: from the demonstration and by the limits, null where it was not computed
        phase: where in the demonstration the motion began: 0, or what a motion that it corrects had reached
        basis_count: functions a joint, 0 where that was not told
        final_error: how far the plan ends from what was asked
        extremes: [min, max] of each quantity over all time, tail included
        margin: smallest distance to each limit, null where there is none
        active: the limits that shape the plan
        certified: no limit is passed at any time, between samples included
        solve_ms: time spent on the quadratic programs of all joints
        rounds: of row generation, the most of any joint
        rows: limit rows in the last program, the most of any joint
    """

    imitation_rms: Vector
    deviation: Deviation | None = None
    phase: Number = 0.0
    basis_count: int = 0
    final_error: FinalError
    extremes: Extremes
    margin: Margin
    active: list[ActiveLimit]
    certified: bool
    solve_ms: Number
    rounds: int
    rows: int


class GoalReply(Message, kw_only=True):
    """The plan: accepted and about to be played, unless the goal said `plan_only`.

    Attributes:
        goal_id: names the motion
        start_time: on the robot's clock
        duration: to the goal
        total_duration: to rest
        positions: where each joint ends
        velocities: with which velocity
        alternative: which end that is: 0 the goal's own, 1 the first of its `alternatives`
        trajectory: with `include_trajectory`, sampled; of a motion over 20 s every nth sample, as `dt` says
        report: what the planner knows of its plan
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
    """A goal that the planner refused, said once its sender has the answer.

    What is turned away before it reaches the planner, because too many requests wait there or the key has a wildcard,
    is not published: only its sender knows of it. Of a body that does not decode nothing is known but the refusal.

    Attributes:
        goal_id: as in the goal, cut to 128 characters, or made for it; null where its body did not decode
        client_id: whose goal it is, may be empty
        primitive: what it was to imitate, empty where that is not known
        code: as answered, see [codes](#codes)
        message: as answered
        detail: as answered
        requested: the planner received it
    """

    goal_id: str | None
    client_id: str
    primitive: str
    code: str
    message: str
    detail: dict[str, Any]
    requested: int
