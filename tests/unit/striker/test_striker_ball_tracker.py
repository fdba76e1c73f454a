"""Assignment of sights to balls."""

import logging

import numpy as np
import pytest

from protocol.messages import BallState
from robot.striking.estimator import Estimator
from robot.striking.flight import GRAVITY, Ball, Court, Surface
from services.striker.ball_tracker import BallTracker

BALL = Ball(0.0027, 0.02)
LAUNCH, VELOCITY = np.array([5.16, -0.09, 1.34]), np.array([-6.32, -0.49, 0.79])


@pytest.mark.parametrize("speed", [0.2, 1.5, 4.0], ids="{} m/s".format)
def test_a_new_ball_is_recognised_while_the_previous_one_rolls(speed: float):
    """A rolling ball is always predicted to bounce, and sights near a bounce are not decisive."""
    tracker = BallTracker(Estimator(BALL, Court(Surface(0.0, 0.9, 0.8))), logging.getLogger("striker"))

    def see(time: float, position: np.ndarray) -> None:
        ball = BallState(time=time, position=position.tolist(), velocity=None, truth=None)
        seen = tracker.checked_position(ball, time)
        assert seen is not None
        tracker.update(ball, seen)

    for time in np.arange(1, 101) * 0.01:
        see(time, np.array([3.0 + speed * time, 0.0, BALL.radius]))
    for time in np.arange(1, 11) * 0.01:
        see(1.0 + time, LAUNCH + VELOCITY * time - [0.0, 0.0, GRAVITY * time**2 / 2])
    found = tracker.estimate(1.1)
    assert found is not None
    assert found.position == pytest.approx(LAUNCH + VELOCITY * 0.1 - [0.0, 0.0, GRAVITY * 0.1**2 / 2], abs=0.02)
    assert found.sights >= 5
