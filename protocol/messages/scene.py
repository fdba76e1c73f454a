"""The scene around the arm: contacts, the ball, further joints."""

from typing import Annotated

from msgspec import Meta, Struct

from protocol.messages.base import Message, Number, Vector

MAX_SCENE_JOINTS = 1024
"""Largest number of joints that are not the arm's; more can be simulated, but not published."""


class Contact(Message, kw_only=True):
    """A contact of two bodies.

    Each contact is published twice: when its impulse reaches 0.01 N·s, and at its end. A weaker contact is not
    published.

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
        time: of the sight, on the robot's clock; the message is later by the latency
        position: with the noise of `ball_noise`
        velocity: null with noise, and from a camera
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
        joints: coordinates by joint: an angle or a distance (rad, m); for a ball joint a quaternion; for a free joint
            position and quaternion. Quaternions have w first
    """

    time: Number
    joints: Annotated[dict[str, Annotated[Vector, Meta(max_length=7)]], Meta(max_length=MAX_SCENE_JOINTS)]
