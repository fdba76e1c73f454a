"""The controller: references, results, status, commands."""

from msgspec import Struct

from protocol.messages.base import Message, Mode, Number, Outcome, Point, Request, Stamps, Vector


class Accepted(Message, kw_only=True):
    """A trajectory will be played from `start_time` on."""

    goal_id: str
    start_time: Number


class ReferenceRequest(Request, kw_only=True):
    """Ask where the arm will be.

    Attributes:
        lead: from now, s
    """

    lead: Number


class Reference(Message, kw_only=True):
    """Where everything accepted so far will have the arm.

    Attributes:
        time: the first tick ≥ now + lead
        epoch: raised by every accept, cancel, fault, reset and new run
        positions: of the reference
        velocities: of the reference
        accelerations: of the reference
        goal_id: whose motion this is a point of; null at rest, and once that motion is stopping
    """

    time: Number
    epoch: int
    positions: Vector
    velocities: Vector
    accelerations: Vector
    goal_id: str | None = None


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
    stop_time: Number


class ModeReply(Message, kw_only=True):
    """The mode of the controller after a reset."""

    mode: Mode


class ResultRequest(Request, kw_only=True):
    """Ask how a goal went."""

    goal_id: str


class Hit(Struct, kw_only=True):
    """The errors at exactly the hit time.

    Attributes:
        time: of the hit, or of the next state where that tick's was lost
        position_error: measured less reference
        velocity_error: measured less reference
        truth_error: true less reference, null where the truth is not known
    """

    time: Number
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
    peak_tracking_error: Number = 0.0
    stamps: Stamps = Stamps()


class Lateness(Struct, kw_only=True):
    """From a state in the loop's hand to the departure of its command, of the last 1000 answers.

    Attributes:
        p50: median, µs
        p99: 99th percentile, µs
        max: largest, µs
    """

    p50: Number
    p99: Number
    max: Number


class Cycle(Struct, kw_only=True):
    """The controller's loop since the run began.

    Attributes:
        count: states answered
        missed: ticks never seen or answered too late
        on_time_ratio: share of the ticks answered in time
        late_us: the time that the last 1000 answers took
        refused: states that were old, doubled or malformed, in all runs
    """

    count: int
    missed: int
    on_time_ratio: Number
    late_us: Lateness
    refused: int


class Status(Message, kw_only=True):
    """The controller at a glance.

    Attributes:
        time: on the robot's clock
        mode: holding a pose, tracking a plan, stopping, or in a fault, which only `reset` or a new run of the arm ends
        epoch: raised by every accept, cancel, fault, reset and new run
        goal_id: what is played, null for nothing
        time_from_start: of what is played
        reference: where the arm should be
        feedback: where it was measured
        error: measured less reference
        cycle: the controller's loop
        fault: in words, null for none
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
        source: who commands
        accelerations: to apply
        positions: of the reference behind them
        velocities: of the reference behind them
        goal_id: what is played, null for nothing
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
