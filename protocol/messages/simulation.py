"""Requests to a simulation alone: steps, new runs, a thrown ball, disturbances."""

from typing import Literal

from msgspec import Struct

from protocol.messages.base import Message, Number, Request, Triple, Vector


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
    """Throw the ball in the present run.

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
    """Disturb the simulation: push the arm, add noise to its sensors or to the camera, let wind blow, drop messages.

    A value of `sensor_noise` or `ball_noise` that is left out is set to 0.

    Attributes:
        kind: of the disturbance; the fields of other kinds must be null
        values: of `acceleration` (rad/s²) or `torque` (N·m) on each joint; of `wind`: velocity of the air (m/s) along
            the three axes of the world, until it is set again
        start_time: of `acceleration` or `torque`, null: now
        duration: of `acceleration`, `torque` or `loss`
        position_std: of `sensor_noise`: standard deviation of measured positions, rad, until it is set again; of
            `ball_noise`: of each coordinate of the ball's position, m, until it is set again
        velocity_std: of `sensor_noise`: standard deviation of measured velocities, rad/s, until it is set again
        stream: of `loss`: the messages that are lost
        latency_s: of `ball_noise`: from the instant of a sight to its message, until it is set again
        drop_rate: of `ball_noise`: part of the sights that are lost, 0 to 1, until it is set again
    """

    kind: Literal["acceleration", "torque", "sensor_noise", "loss", "ball_noise", "wind"]
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


class ActiveDisturbance(Struct, kw_only=True):
    """A disturbance that acts now; fields as in its request.

    Attributes:
        kind: as in the request
        values: on each joint; of `wind` along the axes of the world
        position_std: rad, of `ball_noise` m
        velocity_std: rad/s
        stream: the messages that are lost
        latency_s: of the sights of the ball
        drop_rate: part of the sights of the ball that are lost
        end_time: null if it lasts until it is set again
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
