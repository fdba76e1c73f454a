"""Sights of the ball, checked before the estimator uses them."""

import logging
import math
from collections import deque

import numpy as np

from protocol import messages as m
from robot.striking.estimator import Estimate, Estimator
from services.common.logs import ThrottledLog

LOST_S = 0.15
"""A ball that was not seen for this long is lost, s."""
AHEAD_S = 0.1
"""A sight this far ahead of the robot's clock belongs to another run, s."""
MAX_VALUE = 100.0
"""m, m/s: largest distance and speed of a ball, on each axis."""
REST_SIGHTS, REST_S, REST_M = 6, 0.05, 0.04
"""A ball lies if this many sights, over at least this time (s), are within this distance (m); it rolls if it is this
near the floor."""


class RestDetector:
    """Detects balls that lie, on a tee or on the floor, or roll on the floor."""

    def __init__(self, floor: float) -> None:
        """`floor`: height (m) of the centre of a ball on the floor."""
        self._highest = floor + REST_M
        self._recent: deque[tuple[float, np.ndarray]] = deque(maxlen=REST_SIGHTS)

    def is_at_rest(self, time: float, position: np.ndarray) -> bool:
        """Process a sight, (3,) m at `time` s; return whether the ball lies or rolls."""
        self._recent.append((time, position))
        if len(self._recent) < REST_SIGHTS or time - self._recent[0][0] < REST_S - 1e-6:
            return False
        places = np.array([place for _, place in self._recent])
        return bool(np.all(np.ptp(places, axis=0) < REST_M) or places[:, 2].max() < self._highest)

    def reset(self) -> None:
        """Forget all sights."""
        self._recent.clear()


class BallTracker:
    """Follows one ball with an estimator, and ignores sights that cannot belong to it."""

    def __init__(self, estimator: Estimator, log: logging.Logger) -> None:
        self._estimator = estimator
        self._rejected = ThrottledLog(log)
        self._rest_detector = RestDetector(estimator.court.surface.height + estimator.ball.radius)
        self._newest = -math.inf

    def checked_position(self, ball: m.BallState, now: float) -> np.ndarray | None:
        """Return the position of a sight, (3,) m; None, and a log line, if it is not a valid sight at `now`, s."""
        if len(ball.position) != 3:
            self._rejected.warn(f"a ball with {len(ball.position)} coordinates was left out; space has 3")
        elif ball.time > now + AHEAD_S:
            self._rejected.warn(f"a ball seen at {ball.time:.3f} s was left out; the robot's time is {now:.3f} s")
        elif any(abs(value) > MAX_VALUE for value in (*ball.position, *(ball.velocity or ()))):
            self._rejected.warn(f"a ball beyond {MAX_VALUE:g} m or m/s was left out: {ball.position}, {ball.velocity}")
        elif ball.time <= self._newest:
            self._rejected.warn("a ball that was not seen later than the one before was left out")
        else:
            self._newest = ball.time
            return np.array(ball.position, dtype=float)
        return None

    def update(self, ball: m.BallState, position: np.ndarray) -> str:
        """Process a checked sight; return why the previous ball has ended, as a sentence, or an empty string."""
        if self._rest_detector.is_at_rest(ball.time, position):
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

    def estimate(self, now: float) -> Estimate | None:
        """Return the estimate of the ball, None if it was not seen recently."""
        return None if self._estimator.age(now) > LOST_S else self._estimator.estimate

    def reset(self, new_run: bool = False) -> None:
        """Forget the ball; with `new_run`, also the times of its sights."""
        self._estimator.reset()
        self._rest_detector.reset()
        if new_run:
            self._newest = -math.inf
