"""The controller: references, results, status, commands."""

from msgspec import Struct

from protocol.messages.base import Message, Mode, Number, Outcome, Point, Request, Stamps, Vector


class Accepted(Message, kw_only=True):
    """The trajectory is accepted and begins at `start_time`."""

    goal_id: str
    start_time: Number


class ReferenceRequest(Request, kw_only=True):
    """Ask for the reference some time from now.

    Attributes:
        lead: time from now, s
    """

    lead: Number


class Reference(Message, kw_only=True):
    """The state of the reference trajectory at one time, given everything accepted so far.

    Attributes:
        time: the first tick ≥ now + lead
        epoch: raised by every accept, cancel, fault, reset and new run
        positions: of the reference
        velocities: of the reference
        accelerations: of the reference
        goal_id: of the motion to which this state belongs; null at rest and while a motion is being stopped
    """

    time: Number
    epoch: int
    positions: Vector
    velocities: Vector
    accelerations: Vector
    goal_id: str | None = None


class Cancel(Request, kw_only=True):
    """Stop the motion.

    The arm stops as fast as the robot's own limits allow, also if the goal had tighter ones.

    Attributes:
        goal_id: stop this motion only; null: any motion
    """

    goal_id: str | None = None


class Canceled(Message, kw_only=True):
    """The arm is stopping.

    Attributes:
        goal_id: of the stopped motion; null if nothing moved, or if the motion that was named has ended or was
            replaced: the newest motion then continues
        stop_time: time at which the arm is at rest
    """

    goal_id: str | None
    stop_time: Number


class ModeReply(Message, kw_only=True):
    """The mode of the controller after a reset."""

    mode: Mode


class ResultRequest(Request, kw_only=True):
    """Ask for the outcome of a goal."""

    goal_id: str


class Hit(Struct, kw_only=True):
    """Tracking errors at exactly the hit time.

    Attributes:
        time: of the hit, or of the next state if the state of that tick was lost
        position_error: measured minus reference
        velocity_error: measured minus reference
        truth_error: true minus reference, null if the true state is not known
    """

    time: Number
    position_error: Vector
    velocity_error: Vector
    truth_error: Point | None = None


class FirstContact(Struct, kw_only=True):
    """The first contact of the arm.

    Attributes:
        body: of the arm
        other: the other body, which may be one of the arm
        time: of the touch
    """

    body: str
    other: str
    time: Number


class Recoil(Struct, kw_only=True):
    """The recoil of a hit, within the bounds of the robot's `[racket.recoil]`.

    Attributes:
        time: at which a joint exceeded the tolerance, or its velocity error was large enough to make it exceed it
        peak_error: largest of any joint, rad
        peak_time: of that error
        back_time: at which the arm was within the tolerance again, null before
        tolerance: of position, rad on every joint
    """

    time: Number
    peak_error: Number
    peak_time: Number
    back_time: Number | None = None
    tolerance: Number


class Result(Message, kw_only=True):
    """The outcome of a goal.

    Attributes:
        goal_id: of the goal
        outcome: `succeeded`: played to rest; `missed`: played to rest, but the error at the hit exceeded the goal's
            tolerance (by the true state if it is known)
        reason: a sentence
        hit: null where the hit was not reached
        peak_tracking_error: largest of any joint at any time, rad
        saturated_ticks: ticks so far in which the torque of a joint was clipped
        first_contact: of the arm during the motion, null for none
        recoil: of the hit, null for none. `ended` does not wait for the arm's return from a recoil
        stamps: times at which it reached each stage
    """

    goal_id: str
    outcome: Outcome
    reason: str = ""
    hit: Hit | None = None
    peak_tracking_error: Number = 0.0
    saturated_ticks: int = 0
    first_contact: FirstContact | None = None
    recoil: Recoil | None = None
    stamps: Stamps = Stamps()


class Lateness(Struct, kw_only=True):
    """Time from a received state to its published command, over the last 1000 answers.

    Attributes:
        p50: median, µs
        p99: 99th percentile, µs
        max: largest, µs
    """

    p50: Number
    p99: Number
    max: Number


class Cycle(Struct, kw_only=True):
    """Statistics of the controller's loop since the run began.

    Attributes:
        count: states answered
        missed: ticks that were lost or answered too late
        on_time_ratio: share of the ticks answered in time
        late_us: duration of the last 1000 answers
        refused: states that were old, duplicated or malformed, over all runs
    """

    count: int
    missed: int
    on_time_ratio: Number
    late_us: Lateness
    refused: int


class Status(Message, kw_only=True):
    """A summary of the controller.

    Attributes:
        time: on the robot's clock
        mode: holding a pose, tracking a plan, stopping, or in a fault; only `reset` or a new run ends a fault
        epoch: raised by every accept, cancel, fault, reset and new run
        goal_id: of the motion under way, null for none
        time_from_start: of that motion
        reference: of the reference trajectory
        feedback: measured
        error: measured minus reference
        cycle: statistics of the controller's loop
        fault: a sentence, null for none
    """

    time: Number
    mode: Mode
    epoch: int
    goal_id: str | None
    time_from_start: Number | None
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
        source: name of the sender
        accelerations: to apply
        positions: of the reference
        velocities: of the reference
        goal_id: of the motion under way, null for none
        next: of the reference at the end of the tick
        feedforward: mean acceleration of the reference over the tick: `accelerations` less feedback
    """

    run: int
    tick: int
    source: str
    accelerations: Vector
    positions: Vector
    velocities: Vector
    goal_id: str | None
    next: Point | None = None
    feedforward: Vector | None = None
