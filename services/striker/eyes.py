"""Sights of the ball, on their way into the estimator."""

import logging
import math

import numpy as np

from protocol import messages as m
from robot.striking.estimator import Estimate, Estimator
from services.common.logs import ThrottledLog
from services.striker.watching import Stillness

LOST_S = 0.15
"""A ball that was not seen for so long has stopped coming."""
AHEAD_S = 0.1
"""A sight that is so far ahead of the robot's clock is not of this run."""
REACH = 100.0
"""m, m/s: no ball that is struck is farther away or faster, on any axis."""


class Eyes:
    """Follows one ball with an estimator, and leaves out sights that cannot be of it."""

    def __init__(self, estimator: Estimator, log: logging.Logger) -> None:
        self._estimator = estimator
        self._rejected = ThrottledLog(log)
        self._stillness = Stillness(estimator.court.surface.height + estimator.ball.radius)
        self._newest = -math.inf

    def read(self, ball: m.BallState, now: float) -> np.ndarray | None:
        """Return where a ball was seen, (3,) m; None where that is no sight of a ball, which is logged."""
        if len(ball.position) != 3:
            self._rejected.warn(f"a ball with {len(ball.position)} coordinates was left out; space has 3")
        elif ball.time > now + AHEAD_S:
            self._rejected.warn(f"a ball seen at {ball.time:.3f} s was left out; the robot's time is {now:.3f} s")
        elif any(abs(value) > REACH for value in (*ball.position, *(ball.velocity or ()))):
            self._rejected.warn(f"a ball beyond {REACH:g} m or m/s was left out: {ball.position}, {ball.velocity}")
        elif ball.time <= self._newest:
            self._rejected.warn("a ball that was not seen later than the one before was left out")
        else:
            self._newest = ball.time
            return np.array(ball.position, dtype=float)
        return None

    def follow(self, ball: m.BallState, position: np.ndarray) -> str:
        """Take in a sight that was read; return why the ball before it is over, as a sentence, or empty."""
        if self._stillness.is_still(ball.time, position):
            self._estimator.reset()
            return ""
        velocity = None if ball.velocity is None or len(ball.velocity) != 3 else np.array(ball.velocity, dtype=float)
        match self._estimator.observe(ball.time, position, velocity):
            case "rejected":
                self._rejected.warn("a ball was seen where the one that is followed cannot be; it was left out")
            case "started":
                return "the ball was lost"
            case "new ball":
                return "another ball was seen"
            case _:
                pass
        return ""

    def ball(self, now: float) -> Estimate | None:
        """Return what is known of the ball, None where none was seen lately."""
        return None if self._estimator.age(now) > LOST_S else self._estimator.estimate

    def forget(self, new_run: bool = False) -> None:
        """Forget the ball; of a `new_run`, the times of its sights too."""
        self._estimator.reset()
        self._stillness.reset()
        if new_run:
            self._newest = -math.inf
