"""Strikes of a ball: the request to the striker, and its decisions."""

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from protocol.messages.base import Message, Number, Request, Triple

MAX_PRIMITIVES = 256
"""More than a striker chooses from in time."""
StrikePhase = Literal["seen", "planned", "revised", "refused", "hit", "missed", "landed"]


class StrikeRequest(Request, kw_only=True):
    """Return every ball that comes within reach, until `strike/stop` or `count` balls.

    A further request replaces the one before; for a ball on its way it moves the target.

    Attributes:
        target: where the balls must land, world frame, m
        flight_time: s from the touch to the landing, null: chosen by the striker
        count: balls to strike at, null: without end
        primitives: names of primitives that may be imitated, null: any of the library
        revise_hz: corrections a second while the arm swings, 0: none
        until_s: the last correction is this long before the touch, s
    """

    target: Triple
    flight_time: Number | None = None
    count: int | None = None
    primitives: Annotated[list[str], Meta(max_length=MAX_PRIMITIVES)] | None = None
    revise_hz: Number = 50.0
    until_s: Number = 0.05


class Striking(Message, kw_only=True):
    """Whether the striker is active."""

    active: bool


class BallPrediction(Struct, kw_only=True):
    """The predicted ball at the planned hit, or where it was last expected: world frame.

    Attributes:
        time: on the robot's clock
        position: m
        velocity: m/s
        spread: standard deviation of each coordinate of the position, m
        path: positions (m) on the way there, in equal steps of time from the newest sight on
    """

    time: Number
    position: Triple
    velocity: Triple
    spread: Triple
    path: Annotated[list[Triple], Meta(max_length=256)] = field(default_factory=list)


class RacketAim(Struct, kw_only=True):
    """The racket at the planned touch: world frame.

    Attributes:
        time: of the touch, on the robot's clock
        position: of the tool, m
        normal: of the face that the ball meets, of length 1
        velocity: of the tool, m/s
        outgoing: velocity of the ball after the touch, m/s
        landing: planned landing of the ball, m
        error: expected distance of the landing from the planned one, m
    """

    time: Number
    position: Triple
    normal: Triple
    velocity: Triple
    outgoing: Triple
    landing: Triple
    error: Number


class BallHit(Struct, kw_only=True):
    """The touch as it was observed.

    Attributes:
        time: on the robot's clock
        position: of the ball, m
        velocity: of the ball after the touch, m/s, null if too few sights followed
    """

    time: Number
    position: Triple
    velocity: Triple | None = None


class Landing(Struct, kw_only=True):
    """The landing of the ball after the hit.

    Attributes:
        time: on the robot's clock
        position: m
        distance: from the target, horizontally, m
        net: the ball touched the net before
        out: the ball landed outside the `region` of the robot's `[court]`
    """

    time: Number
    position: Triple
    distance: Number
    net: bool = False
    out: bool = False


class Strike(Message, kw_only=True):
    """A decision or an observation of the striker.

    Attributes:
        ball: counted from 1 since the striker was started
        phase: seen: a ball approaches; planned, revised: a motion for it is played, or was corrected; refused: the
            planner refused the motion or the newest correction, `reason` says why; hit, missed; landed
        time: on the robot's clock
        sight: time of the newest sight on which the decision is based, null without one
        prediction: of the ball, null without a prediction
        racket: null before a hit is chosen
        goal_id: of the motion that is played, null before there is one
        revisions: corrections taken so far
        hit: null before the touch
        landing: null before the ball landed
        reason: a sentence
    """

    ball: int
    phase: StrikePhase
    time: Number
    sight: Number | None = None
    prediction: BallPrediction | None = None
    racket: RacketAim | None = None
    goal_id: str | None = None
    revisions: int = 0
    hit: BallHit | None = None
    landing: Landing | None = None
    reason: str = ""
