"""The robot, simulated or real: states, description, recovery, the clock of the sim, disturbances."""

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from protocol.messages.base import (
    Clock,
    Condition,
    DriveMode,
    Joints,
    Message,
    Names,
    Number,
    PartialVector,
    Point,
    Range,
    Request,
    TorqueSource,
    Triple,
    Vector,
)

MAX_SCENE_JOINTS = 1024
"""Joints beside the arm's; more can be simulated, but not published."""


class State(Message, kw_only=True):
    """The measured state of the arm.

    Attributes:
        run: number of this run of the arm: Unix ns of its start, in stepped time the seed
        tick: counted from the start of the run
        time: tick / rate
        positions: measured
        velocities: measured
        torques: applied over the previous tick
        saturated: whether the torque of each joint was clipped
        brake: the arm brakes because commands are missing
        applied_tick: tick of the state that the newest applied command answered, −1 before the first
        truth: positions and velocities without sensor noise, null on a real arm
        condition: `ready`: the arm follows commands; otherwise the reason why it does not: its own brake, a reflex, the
            user's stop, hand guiding, or that it is not ready
        reason: of the condition, a sentence
        held: positions of the joints that are held, rad or m by name
    """

    run: int
    tick: int
    time: Number
    positions: Vector
    velocities: Vector
    torques: Vector
    saturated: list[bool]
    brake: bool
    applied_tick: int
    truth: Point | None = None
    condition: Condition = "ready"
    reason: str = ""
    held: Joints = field(default_factory=dict)


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
    """Description of the arm.

    Attributes:
        joint_names: in the order of every vector
        home: the pose at the start, rad
        limits: the robot's own
        rate_hz: ticks per second
        clock: `realtime`; `stepped`: advanced by `sim/step`; `paced`: no faster than the wall clock, where each tick
            waits for the controller's answer to the last
        run: number of this run of the arm
        delay_ticks: a command that answers tick k is applied at k + delay_ticks
        modes: in which the arm can be driven
        torques_are: origin of the torques in its states
        ball_rate_hz: at which `ball` is published, null in a scene without one
    """

    joint_names: Names
    home: Vector
    limits: RobotLimits
    rate_hz: Number
    clock: Clock
    run: int
    delay_ticks: int = 0
    modes: list[DriveMode] = field(default_factory=lambda: ["torque"])
    torques_are: TorqueSource = "commanded"
    ball_rate_hz: Number | None = None


class Recovered(Message, kw_only=True):
    """How the recovery ended.

    Attributes:
        condition: `ready`, or what still keeps the arm from following commands
        run: the new one where the arm is ready, else the one before
    """

    condition: Condition
    run: int


class Hold(Request, kw_only=True):
    """Lead held joints, as those of a gripper, to new values.

    Attributes:
        joints: rad or m by name; the others keep their values
    """

    joints: Joints


class Held(Message, kw_only=True):
    """The held joints are on their way.

    Attributes:
        joints: as in the request
        arrival_time: time at which they are there unless something keeps them from it, null where it is not known
    """

    joints: Joints
    arrival_time: Number | None


class Guided(Message, kw_only=True):
    """Whether the arm is guided by hand.

    Attributes:
        condition: `guiding`: it yields to pushes, the controller is in fault and goals are refused, until `recover`; or
            what it still is
    """

    condition: Condition


class Step(Request, kw_only=True):
    """Advance the stepped clock.

    Attributes:
        ticks: 1 to 10000
    """

    ticks: int


class Stepped(Message, kw_only=True):
    """The time after the last step."""

    tick: int
    time: Number


class Ball(Struct, forbid_unknown_fields=True, kw_only=True):
    """A ball in the world frame: m, m/s; at rest unless a velocity is given."""

    position: Triple
    velocity: Triple = (0.0, 0.0, 0.0)


class Throw(Request, kw_only=True):
    """Put the ball in flight, in the run that goes on.

    Attributes:
        position: world frame, m
        velocity: m/s
        spin: angular velocity, rad/s, world frame; null: none
    """

    position: Triple
    velocity: Triple
    spin: Triple | None = None


class Thrown(Message, kw_only=True):
    """The ball is in flight from `time` on."""

    time: Number


class Reset(Request, kw_only=True):
    """Begin a new run.

    Attributes:
        positions: of the arm at rest, null: home
        ball: null: on its tee
        seed: of the sensor noise; with a stepped clock also the number of the run
    """

    positions: Vector | None = None
    ball: Ball | None = None
    seed: int = 0


class ResetDone(Message, kw_only=True):
    """The new run is at tick 0."""

    tick: int
    time: Number
    run: int


class Disturb(Request, kw_only=True):
    """Disturb the arm: push it, add noise to its sensors or to the sight of the ball, or drop messages.

    Attributes:
        kind: of the disturbance; fields that belong to another kind stay null
        values: of `acceleration` (rad/s²) or `torque` (N·m) on each joint
        start_time: of `acceleration` or `torque`, null: now
        duration: of `acceleration`, `torque` or `loss`
        position_std: of `sensor_noise`: standard deviation of measured positions, rad, until it is set again; of
            `ball_noise`: of each coordinate of the ball's position, m, until it is set again
        velocity_std: of `sensor_noise`: standard deviation of measured velocities, rad/s, until it is set again
        stream: of `loss`: the messages that are lost
        latency_s: of `ball_noise`: from the instant of a sight to its message, until it is set again
        drop_rate: of `ball_noise`: part of the sights that are lost, 0 to 1, until it is set again
    """

    kind: Literal["acceleration", "torque", "sensor_noise", "loss", "ball_noise"]
    values: Vector | None = None
    start_time: Number | None = None
    duration: Number | None = None
    position_std: Number | None = None
    velocity_std: Number | None = None
    stream: Literal["state", "command"] | None = None
    latency_s: Number | None = None
    drop_rate: Number | None = None


class Disturbed(Message, kw_only=True):
    """The disturbance begins at `start_time`."""

    start_time: Number


class Contact(Message, kw_only=True):
    """Two bodies touch, or have parted.

    Each contact is published twice, unless its impulse stays below 0.01 N·s: when it reaches that, and at its end.

    Attributes:
        time: of the first touch
        bodies: names of the bodies
        impulse: so far, N·s
        ball_velocity: after the contact, null before its end and for a contact without the ball
        ended: the bodies have parted
    """

    time: Number
    bodies: list[str]
    impulse: Number
    ball_velocity: Vector | None
    ended: bool = True


class BallTruth(Struct, kw_only=True):
    """Where a simulated ball is: m, m/s, and its spin, an angular velocity in rad/s."""

    position: Vector
    velocity: Vector
    spin: Vector


class BallState(Message, kw_only=True):
    """The ball in the world frame, as a camera sees it: m, m/s.

    Attributes:
        time: of the sight, on the robot's clock; the message comes later by the latency
        position: with noise where there is some
        velocity: null where there is noise, and for a camera
        truth: null on a real robot
    """

    time: Number
    position: Vector
    velocity: Vector | None = None
    truth: BallTruth | None = None


class Scene(Message, kw_only=True):
    """The joints of the robot's model that are neither the arm's nor the ball's: grippers, loose objects, other arms.

    Attributes:
        time: on the robot's clock
        joints: coordinates by joint: an angle or a distance (rad, m); a quaternion of a joint with three axes; position
            and quaternion of a body that moves freely. Quaternions have w first
    """

    time: Number
    joints: Annotated[dict[str, Annotated[Vector, Meta(max_length=7)]], Meta(max_length=MAX_SCENE_JOINTS)]


class ActiveDisturbance(Struct, kw_only=True):
    """A disturbance that acts now; fields as in its request.

    Attributes:
        kind: as in the request
        values: on each joint
        position_std: rad, of `ball_noise` m
        velocity_std: rad/s
        stream: the messages that are lost
        latency_s: of the sights of the ball
        drop_rate: part of the sights of the ball that are lost
        end_time: null where it lasts until it is set again
    """

    kind: str
    values: Vector | None = None
    position_std: Number | None = None
    velocity_std: Number | None = None
    stream: str | None = None
    latency_s: Number | None = None
    drop_rate: Number | None = None
    end_time: Number | None = None


class Disturbance(Message, kw_only=True):
    """All disturbances that act now."""

    time: Number
    active: list[ActiveDisturbance]
