"""Ball and court of a robot's description in the form of the striking mathematics."""

import numpy as np

from robot.court import CourtConfig
from robot.description import RobotConfig
from robot.striking.flight import Ball, Court, Net, Surface


def ball_of(config: RobotConfig) -> Ball:
    """Return the ball of a robot that has one; its flight is that of the robot's simulation."""
    ball = config.ball
    assert ball is not None
    return Ball(ball.mass, ball.radius, ball.drag, ball.magnus, float(config.model.opt.timestep))


def court_of(config: CourtConfig, clearance: float) -> Court:
    """Return a court. clearance: m above the net, of returned balls."""
    surface = Surface(config.height, config.restitution, config.friction, config.dwell)
    if config.net is None:
        return Court(surface)
    net = Net(np.array(config.net.top), np.array(config.net.normal), config.net.half_width)
    return Court(surface, net, clearance)
