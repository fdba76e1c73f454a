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
    """Where a planned motion begins: rad, rad/s, rad/s²; an acceleration of null is free."""

    positions: Vector
    velocities: Vector | None = None
    accelerations: PartialVector | None = None


class Waypoint(Struct, forbid_unknown_fields=True, kw_only=True):
    """Met exactly `time_from_start` seconds after the start, 0 < time < duration; null entries are free."""

    time_from_start: float
    positions: PartialVector | None = None
    velocities: PartialVector | None = None


class GoalLimits(Struct, forbid_unknown_fields=True, kw_only=True):
    """Tighter limits for one goal, symmetric but for positions; null means the robot's own."""

    positions: list[Range | None] | None = None
    velocities: PartialVector | None = None
    accelerations: PartialVector | None = None
    jerks: PartialVector | None = None


class Goal(Request, kw_only=True):
    """Play `primitive` to `positions`.

    `velocities` are zero unless given. `accelerations` of null are free where the final velocity is not zero and
    zero where it is. `duration` counts from the start, `arrival_time` is on the robot's clock; without either the
    motion takes as long as its demonstration. `start` of null continues the reference as it moves.
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
    """A limit that shapes the plan, and when (s from the start)."""

    joint: str
    quantity: str
    time_from_start: float


class Report(Struct, kw_only=True):
    """What the planner knows of its plan.

    `imitation_rms`: rms of g̈ − τ²d̈ over the motion, rad/s² a joint. `extremes`: [min, max] of each quantity over
    all time, tail included. `margin`: the smallest distance to each limit, null where there is none. `certified`:
    no limit is passed at any time, between samples included. `rounds` and `rows`: of the row generation.
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
    """When a goal reached each stage, Unix ns; null where it has not."""

    requested: int | None = None
    planned: int | None = None
    accepted: int | None = None
    first_command: int | None = None


class Trajectory(Request, kw_only=True):
    """A sampled motion: sample 0 lies at `start_time`, sample `hit_index` at the goal, the last at rest.

    `positions`, `velocities` and `accelerations` are matrices of `count` × joints. `epoch` is the controller's at
    planning time: a plan made under an older one is `superseded`.
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
    """The answer to a goal: `duration` to the goal, `total_duration` with the tail to rest, s."""

    goal_id: str
    start_time: float
    duration: float
    total_duration: float
    trajectory: Trajectory | None = None
    report: Report


class PlanLimits(PerQuantity, kw_only=True):
    """The limits a plan was made under: positions [lo, hi], the rest symmetric; null where there is none."""


class Plan(Message, kw_only=True):
    """A trajectory that was accepted, with what it was made of.

    `demonstration` is the demonstrated position, warped to the duration: a matrix of (`hit_index` + 1) × joints.
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
    """The smoothing filter: a polynomial of `order` over `window_s` seconds."""

    window_s: float
    order: int


class Learn(Request, kw_only=True):
    """Learn a primitive from `positions`: [[…joints]…samples], or a matrix together with `joint_count`.

    Sampled at `rate` Hz, or at `times` (s).
    """

    name: str
    positions: list[Vector] | bytes
    joint_count: int | None = None
    rate: float | None = None
    times: Vector | None = None
    smoothing: Literal["auto", "none"] | SavitzkyGolay = "auto"
    replace: bool = False


class Learned(Message, kw_only=True):
    """What was learned: `fit_rms` rad/s² and `noise_estimate` rad a joint; `smoothing` null where none was used."""

    name: str
    duration: float
    basis_count: int
    fit_rms: Vector
    noise_estimate: Vector
    smoothing: SavitzkyGolay | None = None


class PrimitiveEntry(Struct, kw_only=True):
    """One primitive of the library; `created` in Unix s."""

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
    """Ask where the arm will be `lead` seconds from now."""

    lead: float


class Reference(Message, kw_only=True):
    """Where everything accepted so far will have the arm at `time`, the first tick ≥ now + lead."""

    time: float
    epoch: int
    positions: Vector
    velocities: Vector
    accelerations: Vector


class Cancel(Request, kw_only=True):
    """Stop the motion of `goal_id`, or whatever moves."""

    goal_id: str | None = None


class Canceled(Message, kw_only=True):
    """The arm will be at rest at `stop_time`; `goal_id` is null where nothing moved."""

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
    """The errors at exactly the hit time: measured less reference (rad, rad/s), and true less reference where known."""

    time: float
    position_error: Vector
    velocity_error: Vector
    truth_error: Point | None = None


class Result(Message, kw_only=True):
    """How a goal went. `succeeded` means played to rest; errors are reported, not judged.

    `hit` is null where the hit was not reached; `peak_tracking_error` in rad.
    """

    goal_id: str
    outcome: Outcome
    reason: str = ""
    hit: Hit | None = None
    peak_tracking_error: float = 0.0
    stamps: Stamps = Stamps()


class Lateness(Struct, kw_only=True):
    """From the arrival of a state to the departure of its command, µs."""

    p50: float
    p99: float
    max: float


class Cycle(Struct, kw_only=True):
    """The controller's loop since the run began.

    `count` states answered, `missed` ticks never seen or answered too late, `refused` messages that were malformed.
    """

    count: int
    missed: int
    on_time_ratio: float
    late_us: Lateness
    refused: int


class Status(Message, kw_only=True):
    """The controller at a glance."""

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
    """The controller's answer to state `tick`: accelerations (rad/s²) to apply, and the reference behind them."""

    run: int
    tick: int
    source: str
    accelerations: Vector
    positions: Vector
    velocities: Vector
    goal_id: str | None


# --- the arm --------------------------------------------------------------------------------------------


class State(Message, kw_only=True):
    """What the arm measures at `tick` of life `run`; `time` = tick / rate.

    `torques` were applied over the tick before; `saturated` marks those that were clipped. `brake`: the arm stops
    itself for want of commands. `applied_tick`: the state that the newest applied command answered, −1 before the
    first. `truth` is free of sensor noise, null on a real arm.
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
    """The robot's own limits: positions [lo, hi], the rest symmetric; null where there is none."""

    positions: list[Range | None]
    velocities: PartialVector
    accelerations: PartialVector
    jerks: PartialVector
    torques: PartialVector


class Description(Message, kw_only=True):
    """What the arm is."""

    joint_names: list[str]
    home: Vector
    limits: RobotLimits
    rate_hz: float
    clock: Clock
    run: int


class Step(Request, kw_only=True):
    """Advance the stepped clock by `ticks`, 1 to 10000."""

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
    """Begin a new run at `positions` (null: home), with the ball where given (null: on its tee).

    `seed` of the sensor noise; it also names the run where the clock is stepped.
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
    """Disturb the arm.

    `acceleration` (rad/s²) and `torque` (N·m): `values` a joint, from `start_time` (null: now) for `duration` s.
    `sensor_noise`: standard deviations of the measured positions and velocities, until told otherwise.
    `loss`: the messages of `stream` are lost for `duration` s.
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
    """Two bodies touched: the impulse in N·s over the contact, the ball's velocity after it in m/s."""

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
    """One disturbance that acts now; `end_time` null where it lasts until told otherwise."""

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
    """The body of every refusal."""

    code: str
    message: str
    detail: dict[str, Any]
