"""The messages of the wire contract, version 1.

Units are SI throughout: rad, rad/s, rad/s², rad/s³, s, N·m, m, m/s, N·s. Vectors over joints are lists in
the order of `joint_names`. A matrix is `bytes`: little-endian float64, row-major, samples × joints. Requests
refuse unknown fields; publications and replies may gain fields, so their readers ignore unknown ones.
"""

from typing import Any, Literal

from msgspec import Struct

Vector = list[float]
PartialVector = list[float | None]
Range = tuple[float, float]

Outcome = Literal["running", "succeeded", "preempted", "canceled", "aborted"]
Mode = Literal["holding", "tracking", "stopping", "fault"]
Clock = Literal["realtime", "stepped"]


class Message(Struct, kw_only=True):
    """What every message has: the version of the contract, 1."""

    version: Literal[1] = 1


class Request(Message, forbid_unknown_fields=True):
    """A message that asks for something; unknown fields are refused."""


class Empty(Request, kw_only=True):
    """The request without fields, `{}`; an absent body counts as one."""


# --- goal ---------------------------------------------------------------------------------------------


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


class Waypoint(Struct, forbid_unknown_fields=True, kw_only=True):
    """A place or velocity on the way, met exactly, on a tick or not.

    Attributes:
        time_from_start: 0 < time < duration
        positions: null, whole or for one joint: free
        velocities: null, whole or for one joint: free
    """

    time_from_start: float
    positions: PartialVector | None = None
    velocities: PartialVector | None = None


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


class Goal(Request, kw_only=True):
    """Play `primitive` to `positions`.

    Attributes:
        primitive: what to imitate
        positions: where each joint ends
        velocities: with which velocity, null: zero
        accelerations: with which acceleration; null, whole or for one joint: free where the final velocity is not zero,
            zero where it is
        duration: from the start, rounded up to a tick; without it and `arrival_time` as long as the demonstration
        arrival_time: on the robot's clock, to the nearest tick; not together with `duration`
        goal_id: names the motion in everything that follows, null: made by the planner; the same one with the same body
            answers as the first did and moves nothing, with another body it is `duplicate`
        client_id: whose goal it is
        lease: the client holds the liveliness token `alive/client/CLIENT_ID`, its loss cancels the motion, and until
            the end other clients' goals get `not_holder`
        start: null: go on from where everything accepted so far will have the arm; given only with `plan_only`
        waypoints: places to meet on the way, 0.01 of the duration or more from each other and from the ends
        limits: tighter than the robot's own; where both say something the tighter holds
        rest_fraction: final part of the duration with exactly zero acceleration, 0 ≤ ρ < 1; `accelerations` must then
            be null or 0
        tail: after the goal: stop inside the limits, or coast on with the final velocity (only with `plan_only`)
        method: the quadratic program, or the movement primitive that it is compared with
        plan_only: reply without moving
        include_trajectory: reply with the samples
        preempt: take the place of a motion that runs; false: `busy` while there is one
    """

    primitive: str
    positions: Vector
    velocities: Vector | None = None
    accelerations: PartialVector | None = None
    duration: float | None = None
    arrival_time: float | None = None
    goal_id: str | None = None
    client_id: str = ""
    lease: bool = False
    start: Start | None = None
    waypoints: list[Waypoint] = []
    limits: GoalLimits | None = None
    rest_fraction: float = 0.0
    tail: Literal["stop", "coast"] = "stop"
    method: Literal["qp", "dmp"] = "qp"
    plan_only: bool = False
    include_trajectory: bool = False
    preempt: bool = True


class PerQuantity(Struct, kw_only=True):
    """One list over joints for each limited quantity."""

    positions: list[Any]
    velocities: list[Any]
    accelerations: list[Any]
    jerks: list[Any]


class FinalError(Struct, kw_only=True):
    """How far the plan ends from what was asked, recomputed from the solution: rad, rad/s."""

    positions: Vector
    velocities: Vector


class ActiveLimit(Struct, kw_only=True):
    """A limit that shapes the plan.

    Attributes:
        joint: its name
        quantity: positions, velocities, accelerations or jerks
        time_from_start: when
    """

    joint: str
    quantity: str
    time_from_start: float


class Report(Struct, kw_only=True):
    """What the planner knows of its plan, recomputed from the solution.

    Attributes:
        imitation_rms: root mean square of g̈ − τ²d̈ over the motion, rad/s² a joint
        final_error: how far the plan ends from what was asked
        extremes: [min, max] of each quantity over all time, tail included
        margin: smallest distance to each limit, null where there is none
        active: the limits that shape the plan
        certified: no limit is passed at any time, between samples included
        solve_ms: time spent on the quadratic programs of all joints
        rounds: of row generation, the most of any joint
        rows: limit rows in the last programs, all joints together
    """

    imitation_rms: Vector
    final_error: FinalError
    extremes: PerQuantity
    margin: PerQuantity
    active: list[ActiveLimit]
    certified: bool
    solve_ms: float
    rounds: int
    rows: int


class Stamps(Struct, frozen=True):
    """When a goal reached each stage, Unix ns; null where it has not.

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


class Trajectory(Request, kw_only=True):
    """A sampled motion from `start_time` through the goal to rest.

    Attributes:
        goal_id: the goal it serves
        client_id: whose goal it is
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
    joint_names: list[str]
    start_time: float
    dt: float
    count: int
    hit_index: int
    positions: bytes
    velocities: bytes
    accelerations: bytes
    stamps: Stamps = Stamps()


class GoalReply(Message, kw_only=True):
    """The plan: accepted and about to be played, unless the goal said `plan_only`.

    Attributes:
        goal_id: names the motion
        start_time: on the robot's clock
        duration: to the goal
        total_duration: to rest
        trajectory: with `include_trajectory`
        report: what the planner knows of its plan
    """

    goal_id: str
    start_time: float
    duration: float
    total_duration: float
    trajectory: Trajectory | None = None
    report: Report


class PlanLimits(PerQuantity, kw_only=True):
    """The limits a plan was made under, the robot's and the goal's together.

    Attributes:
        positions: [low, high] of each joint, null where there is none
        velocities: largest of either sign, null where there is none
        accelerations: largest of either sign, null where there is none
        jerks: largest of either sign, null where there is none
    """


class Plan(Message, kw_only=True):
    """A trajectory that was accepted, with what it was made of.

    Attributes:
        goal_id: the goal it serves
        client_id: whose goal it is
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
        primitive: what it imitates
        limits: it was made under
        waypoints: as asked for
        demonstration: the demonstrated positions, warped to the duration: matrix of (`hit_index` + 1) × joints
    """

    goal_id: str
    client_id: str = ""
    lease: bool = False
    preempt: bool = True
    epoch: int
    joint_names: list[str]
    start_time: float
    dt: float
    count: int
    hit_index: int
    positions: bytes
    velocities: bytes
    accelerations: bytes
    stamps: Stamps = Stamps()
    primitive: str
    limits: PlanLimits
    waypoints: list[Waypoint] = []
    demonstration: bytes = b""


# --- the library of primitives --------------------------------------------------------------------------


class SavitzkyGolay(Struct, forbid_unknown_fields=True, kw_only=True):
    """The smoothing filter.

    Attributes:
        window_s: its length, s
        order: of its polynomial
    """

    window_s: float
    order: int


class Learn(Request, kw_only=True):
    """Learn a primitive from a demonstration.

    Attributes:
        name: of the primitive
        positions: an array of samples, each an array of joints; or a matrix, with `joint_count`
        joint_count: columns of the matrix
        rate: samples per second; this or `times`
        times: of the samples, s, rising
        smoothing: chosen from the noise found, none, or as given
        replace: overwrite a primitive of this name
    """

    name: str
    positions: list[Vector] | bytes
    joint_count: int | None = None
    rate: float | None = None
    times: Vector | None = None
    smoothing: Literal["auto", "none"] | SavitzkyGolay = "auto"
    replace: bool = False


class Learned(Message, kw_only=True):
    """What was learned.

    Attributes:
        name: of the primitive
        duration: of the demonstration
        basis_count: Gaussians a joint
        fit_rms: of the learned accelerations against the demonstration's, rad/s² a joint
        noise_estimate: of the positions, rad a joint
        smoothing: as used, null for none
    """

    name: str
    duration: float
    basis_count: int
    fit_rms: Vector
    noise_estimate: Vector
    smoothing: SavitzkyGolay | None = None


class PrimitiveEntry(Struct, kw_only=True):
    """One primitive of the library.

    Attributes:
        name: to ask for it
        joint_count: its joints
        duration: of the demonstration
        samples: of the demonstration
        created: Unix s
    """

    name: str
    joint_count: int
    duration: float
    samples: int
    created: float


class Primitives(Message, kw_only=True):
    """The library, by name."""

    primitives: list[PrimitiveEntry]


class Forget(Request, kw_only=True):
    """Remove a primitive from the library."""

    name: str


class Forgotten(Message, kw_only=True):
    """The primitive is gone."""

    name: str


# --- the controller -------------------------------------------------------------------------------------


class Accepted(Message, kw_only=True):
    """A trajectory will be played from `start_time` on."""

    goal_id: str
    start_time: float


class ReferenceRequest(Request, kw_only=True):
    """Ask where the arm will be.

    Attributes:
        lead: from now, s
    """

    lead: float


class Reference(Message, kw_only=True):
    """Where everything accepted so far will have the arm.

    Attributes:
        time: the first tick ≥ now + lead
        epoch: raised by every accept, cancel, fault and reset
        positions: of the reference
        velocities: of the reference
        accelerations: of the reference
    """

    time: float
    epoch: int
    positions: Vector
    velocities: Vector
    accelerations: Vector


class Cancel(Request, kw_only=True):
    """Stop the motion.

    Attributes:
        goal_id: stop only this one, null: whatever moves
    """

    goal_id: str | None = None


class Canceled(Message, kw_only=True):
    """The arm is on its way to rest.

    Attributes:
        goal_id: what was stopped, null where nothing moved
        stop_time: when the arm is at rest
    """

    goal_id: str | None
    stop_time: float


class ModeReply(Message, kw_only=True):
    """The mode of the controller after a reset."""

    mode: Mode


class ResultRequest(Request, kw_only=True):
    """Ask how a goal went."""

    goal_id: str


class Point(Struct, kw_only=True):
    """A state of the joints: rad, rad/s."""

    positions: Vector
    velocities: Vector


class Hit(Struct, kw_only=True):
    """The errors at exactly the hit time.

    Attributes:
        time: of the hit
        position_error: measured less reference
        velocity_error: measured less reference
        truth_error: true less reference, null where the truth is not known
    """

    time: float
    position_error: Vector
    velocity_error: Vector
    truth_error: Point | None = None


class Result(Message, kw_only=True):
    """How a goal went; errors are reported, not judged.

    Attributes:
        goal_id: which goal
        outcome: `succeeded` means played to rest
        reason: in words
        hit: null where the hit was not reached
        peak_tracking_error: largest of any joint at any time, rad
        stamps: when it reached each stage
    """

    goal_id: str
    outcome: Outcome
    reason: str = ""
    hit: Hit | None = None
    peak_tracking_error: float = 0.0
    stamps: Stamps = Stamps()


class Lateness(Struct, kw_only=True):
    """From the arrival of a state to the departure of its command.

    Attributes:
        p50: median, µs
        p99: 99th percentile, µs
        max: largest, µs
    """

    p50: float
    p99: float
    max: float


class Cycle(Struct, kw_only=True):
    """The controller's loop since the run began.

    Attributes:
        count: states answered
        missed: ticks never seen or answered too late
        on_time_ratio: share of the ticks answered in time
        late_us: the time an answer took
        refused: states that were old, doubled or malformed
    """

    count: int
    missed: int
    on_time_ratio: float
    late_us: Lateness
    refused: int


class Status(Message, kw_only=True):
    """The controller at a glance.

    Attributes:
        time: on the robot's clock
        mode: holding a pose, tracking a plan, stopping, or in a fault that only `reset` leaves
        epoch: raised by every accept, cancel, fault and reset
        goal_id: what is played, null for nothing
        time_from_start: of what is played
        reference: where the arm should be
        feedback: where it was measured
        error: measured less reference
        cycle: the controller's loop
        fault: in words, null for none
    """

    time: float
    mode: Mode
    epoch: int
    goal_id: str | None
    time_from_start: float | None
    reference: Point
    feedback: Point
    error: Point
    cycle: Cycle
    fault: str | None = None


class Command(Message, kw_only=True):
    """The controller's answer to a state.

    Attributes:
        run: of the state
        tick: of the state
        source: who commands
        accelerations: to apply
        positions: of the reference behind them
        velocities: of the reference behind them
        goal_id: what is played, null for nothing
    """

    run: int
    tick: int
    source: str
    accelerations: Vector
    positions: Vector
    velocities: Vector
    goal_id: str | None


# --- the arm --------------------------------------------------------------------------------------------


class State(Message, kw_only=True):
    """What the arm measures.

    Attributes:
        run: names one life of the arm: Unix ns of its start, in stepped time the seed
        tick: counted from the start of the run
        time: tick / rate
        positions: measured
        velocities: measured
        torques: applied over the tick before
        saturated: where the torque was clipped
        brake: the arm stops itself for want of commands
        applied_tick: of the state that the newest applied command answered, −1 before the first
        truth: free of sensor noise, null on a real arm
    """

    run: int
    tick: int
    time: float
    positions: Vector
    velocities: Vector
    torques: Vector
    saturated: list[bool]
    brake: bool
    applied_tick: int
    truth: Point | None = None


class RobotLimits(Struct, kw_only=True):
    """The robot's own limits; null where there is none.

    Attributes:
        positions: [low, high] of each joint
        velocities: largest of either sign
        accelerations: largest of either sign
        jerks: largest of either sign
        torques: largest of either sign, N·m
    """

    positions: list[Range | None]
    velocities: PartialVector
    accelerations: PartialVector
    jerks: PartialVector
    torques: PartialVector


class Description(Message, kw_only=True):
    """What the arm is.

    Attributes:
        joint_names: in the order of every vector
        home: the pose at the start, rad
        limits: the robot's own
        rate_hz: ticks per second
        clock: real time, or advanced by `sim/step`
        run: names this life of the arm
    """

    joint_names: list[str]
    home: Vector
    limits: RobotLimits
    rate_hz: float
    clock: Clock
    run: int


class Step(Request, kw_only=True):
    """Advance the stepped clock.

    Attributes:
        ticks: 1 to 10000
    """

    ticks: int


class Stepped(Message, kw_only=True):
    """Where the clock stands."""

    tick: int
    time: float


class Ball(Struct, forbid_unknown_fields=True, kw_only=True):
    """A ball in the world frame: m, m/s; at rest unless a velocity is given."""

    position: tuple[float, float, float]
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Reset(Request, kw_only=True):
    """Begin a new run.

    Attributes:
        positions: of the arm at rest, null: home
        ball: null: on its tee
        seed: of the sensor noise; names the run where the clock is stepped
    """

    positions: Vector | None = None
    ball: Ball | None = None
    seed: int = 0


class ResetDone(Message, kw_only=True):
    """The new run stands at tick 0."""

    tick: int
    time: float
    run: int


class Disturb(Request, kw_only=True):
    """Disturb the arm: push it, blur its sensors, or lose messages.

    Attributes:
        kind: what; the fields below that belong to another kind stay null
        values: of `acceleration` (rad/s²) or `torque` (N·m) on each joint
        start_time: of `acceleration` or `torque`, null: now
        duration: of `acceleration`, `torque` or `loss`
        position_std: of `sensor_noise`: standard deviation of measured positions, rad, until told otherwise
        velocity_std: of `sensor_noise`: standard deviation of measured velocities, rad/s, until told otherwise
        stream: of `loss`: whose messages are lost
    """

    kind: Literal["acceleration", "torque", "sensor_noise", "loss"]
    values: Vector | None = None
    start_time: float | None = None
    duration: float | None = None
    position_std: float | None = None
    velocity_std: float | None = None
    stream: Literal["state", "command"] | None = None


class Disturbed(Message, kw_only=True):
    """The disturbance begins at `start_time`."""

    start_time: float


class Contact(Message, kw_only=True):
    """Two bodies touched.

    Attributes:
        time: of the contact
        bodies: their names
        impulse: over the contact, N·s
        ball_velocity: after the contact, null where the ball took no part
    """

    time: float
    bodies: list[str]
    impulse: float
    ball_velocity: Vector | None


class BallState(Message, kw_only=True):
    """The ball in the world frame: m, m/s."""

    time: float
    position: Vector
    velocity: Vector


class ActiveDisturbance(Struct, kw_only=True):
    """One disturbance that acts now; fields as in the request that made it.

    Attributes:
        kind: as in the request
        values: on each joint
        position_std: rad
        velocity_std: rad/s
        stream: whose messages are lost
        end_time: null where it lasts until told otherwise
    """

    kind: str
    values: Vector | None = None
    position_std: float | None = None
    velocity_std: float | None = None
    stream: str | None = None
    end_time: float | None = None


class Disturbance(Message, kw_only=True):
    """Everything that disturbs the arm now."""

    time: float
    active: list[ActiveDisturbance]


class ErrorBody(Struct, kw_only=True):
    """The body of every refusal.

    Attributes:
        code: see [codes](#codes)
        message: a sentence that a person can act on
        detail: what the sentence is about; its fields depend on the code
    """

    code: str
    message: str
    detail: dict[str, Any]
