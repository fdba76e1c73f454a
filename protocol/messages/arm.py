"""The robot, simulated or real: state, description, recovery, held joints, guiding."""

from msgspec import field

from protocol.messages.base import (
    Clock,
    Condition,
    DriveMode,
    Joints,
    Message,
    Names,
    Number,
    PartialVector,
    PlanLimits,
    Point,
    Request,
    TorqueSource,
    Vector,
)


class State(Message, kw_only=True):
    """The measured state of the arm.

    Attributes:
        run: number of this run of the arm: Unix ns of its start; with the clock `stepped` the seed
        tick: counted from the start of the run
        time: tick / rate
        positions: measured
        velocities: measured
        torques: applied over the previous tick
        saturated: whether the torque of each joint was clipped
        brake: the arm brakes because it receives no commands
        applied_tick: tick of the state that the newest applied command answers, −1 before the first command
        truth: positions and velocities without sensor noise, null on a real arm
        condition: `ready`: the arm follows commands. Otherwise it does not: `braking` by itself, after a `reflex`,
            stopped by the user, guided by hand, or not ready. If a request changes it between two ticks, the state of
            the tick is published again
        reason: of the condition, a sentence
        held: positions of the held joints, rad or m by name
        accelerations: of the newest setpoint, that of a command or of the arm's own brake; null if the arm does not
            follow setpoints or, from older robot sides, if unknown
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
    accelerations: Vector | None = None


class RobotLimits(PlanLimits, kw_only=True):
    """The robot's own limits.

    Attributes:
        torques: largest of either sign, N·m, null: no limit
    """

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
        modes: modes in which the arm can be driven
        torques_are: origin of the torques in its states
        ball_rate_hz: rate of `ball`, null in a scene without a ball
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
        condition: `ready`, or the condition in which the arm still does not follow commands
        run: the new run if the arm is ready, otherwise the earlier one
    """

    condition: Condition
    run: int


class Hold(Request, kw_only=True):
    """Move held joints, for example those of a gripper, to new values.

    The body may also be the map of joints itself, {joint: value}.

    Attributes:
        joints: rad or m by name; the others keep their values
    """

    BARE = "joints"
    """Name of the field that may be the whole body; not annotated, because it is not a field itself."""

    joints: Joints


class Held(Message, kw_only=True):
    """The held joints are on their way.

    Attributes:
        joints: as in the request
        arrival_time: time of arrival if nothing blocks them, null if it is not known
    """

    joints: Joints
    arrival_time: Number | None


class Guided(Message, kw_only=True):
    """Whether the arm is guided by hand.

    Attributes:
        condition: `guiding`: the arm yields to pushes, the controller is in fault and goals are refused, until
            `recover`; otherwise the condition that prevents guiding
    """

    condition: Condition
