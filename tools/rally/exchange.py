"""Strokes and serves of two arms that face each other."""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from protocol.messages import Throw
from robot.description import RobotConfig
from robot.kinematics import Kinematics
from robot.striking.conversions import ball_of
from robot.striking.flight import GRAVITY, Air, aim

SERVE = 0.55, 0.25
"""Start of a serve: fraction of the way from the net to the server's racket, and height above the racket, m."""
PARKED_M = 0.2
"""Distances of the resting ball from the net and from the net's end, m, between rallies."""
SPREAD_M = 0.08
"""Largest distance of a serve's bounce from the target on each axis, m. From 0.12 m on, to one side, no posture of
the shipped arm returns the ball."""


@dataclass(frozen=True, slots=True, eq=False)
class Exchange:
    """A stroke that the partner can return.

    The ball bounces at `target` (3,), m, after `flight_time`, s, and has its next apex at the partner's racket at home.
    """

    target: np.ndarray
    flight_time: float


def racket_at_home(config: RobotConfig) -> np.ndarray:
    """Return the position of the racket at home (3,), m."""
    return Kinematics(config).tool_pose(config.home)[0]


def exchange(striker: RobotConfig, partner: RobotConfig) -> Exchange:
    """Return the stroke of `striker` to `partner`, from its racket at home, without drag."""
    court, ball = partner.court, partner.ball
    assert court is not None
    assert ball is not None
    begin, end = racket_at_home(striker), racket_at_home(partner)
    floor = court.height + ball.radius
    rises = sqrt(2 * GRAVITY * (end[2] - floor))
    falls = rises / court.restitution
    flight_time = (falls + sqrt(max(falls**2 - 2 * GRAVITY * (begin[2] - floor), 0.0))) / GRAVITY
    after = court.friction * rises / GRAVITY
    target = end - (end - begin) * after / (flight_time + after)
    return Exchange(np.array([*target[:2], court.height]), flight_time)


def parked_ball(config: RobotConfig) -> Throw:
    """Return a throw that puts the ball at rest on the floor near the end of the net, out of play."""
    ball, court = config.ball, config.court
    assert ball is not None
    assert court is not None
    assert court.net is not None
    normal = np.array(court.net.normal)
    x, y = np.array(court.net.top[:2]) + PARKED_M * normal + (court.net.half_width - PARKED_M) * normal[::-1] * [1, -1]
    return Throw(position=(float(x), float(y), court.height + ball.radius + 1e-3), velocity=(0.0, 0.0, 0.0))


def serve(server: RobotConfig, play: Exchange, random: np.random.Generator) -> Throw:
    """Return a throw from the server's half that bounces near the target of its strokes."""
    ball, court = server.ball, server.court
    assert ball is not None
    assert court is not None
    assert court.net is not None
    fraction, above = SERVE
    top = np.array(court.net.top)
    begin = top + fraction * (racket_at_home(server) - top)
    begin[2] = racket_at_home(server)[2] + above
    place = play.target + np.array([*random.uniform(-SPREAD_M, SPREAD_M, 2), ball.radius])
    velocity = aim(ball_of(server), Air(ball.drag), begin[None], place, np.array([play.flight_time]))[0][0]
    x, y, z = begin.tolist()
    u, v, w = velocity.tolist()
    return Throw(position=(x, y, z), velocity=(u, v, w))
