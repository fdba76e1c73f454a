"""The outcome of a hit, and what is learned from it."""

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from robot.striking.flight import GRAVITY, Air, Ball, Court, time_to_fall, travel
from robot.striking.learning import Learner, outgoing_velocity, write
from services.striker.attempt import Attempt

EARLY_SIGHTS, DEFLECTED_M_S = 12, 0.5
"""A ball has met something if the velocity from this many first sights differs by more than this, m/s."""
MIN_STD = 0.02
"""m/s; least standard deviation of a velocity after a hit."""
MISSED_M_S = 1.0
"""A ball whose velocity changed by less than this was not hit, m/s."""
LONGEST_FLIGHT_S = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """A hit that was seen: its time (s), the ball's position and velocity after it (3,), time and place of landing.

    velocity and landing are None with too few sights.
    """

    time: float
    position: np.ndarray
    velocity: np.ndarray | None
    landing: tuple[float, np.ndarray] | None


class OutcomeEvaluator:
    """Evaluates hits of a ball on a court and updates `learner`, which is stored in the file `learned` for `robot`."""

    def __init__(
        self, ball: Ball, court: Court, learner: Learner, learned: Path, robot: str, log: logging.Logger
    ) -> None:
        self._ball = ball
        self._floor = court.surface.height + ball.radius
        self._learner = learner
        self._learned, self._robot, self._log = learned, robot, log

    def evaluate(self, attempt: Attempt) -> Outcome | None:
        """Return how the ball left the hit, and learn from it; None if it was not hit."""
        choice = attempt.choice
        assert choice is not None
        hit = attempt.contact.time if attempt.contact else choice.time
        after = hit + self._learner.law.duration
        found = self._outgoing(hit, [(time, place) for time, place in attempt.sights if time > after])
        if found is None:
            return Outcome(hit, choice.ball, None, None) if attempt.contact else None
        velocity, std = found
        if attempt.contact is None and np.linalg.norm(velocity - choice.incoming) < MISSED_M_S:
            return None
        if self._learner.observe(choice, self._ball.mass, velocity, max(std, MIN_STD), choice.law_error):
            self._save()
        return Outcome(hit, choice.ball, velocity, self._landing(hit, choice.ball, velocity))

    def _outgoing(self, hit: float, sights: list[tuple[float, np.ndarray]]) -> tuple[np.ndarray, float] | None:
        """Return the velocity (3,) of a ball after a hit, and its std, m/s; None with too few sights."""
        times, places = [time for time, _ in sights], np.array([place for _, place in sights])
        air = Air(self._ball.drag)
        whole = outgoing_velocity(times, places, hit, self._ball, air)
        early = outgoing_velocity(times[:EARLY_SIGHTS], places[:EARLY_SIGHTS], hit, self._ball, air)
        if whole is None or early is None:
            return None
        return early if np.linalg.norm(whole[0] - early[0]) > DEFLECTED_M_S else whole

    def _save(self) -> None:
        """Write the learned law."""
        try:
            write(self._learned, self._robot, self._learner)
        except OSError as error:
            self._log.warning("what was learned is not kept: %s", error)

    def _landing(self, hit: float, place: np.ndarray, velocity: np.ndarray) -> tuple[float, np.ndarray] | None:
        """Return time and place of landing of a ball that leaves `place` (3,); None if it never lands."""
        air = Air(self._ball.drag)
        time = float(time_to_fall(place[2] - self._floor, velocity[2], np.array(-GRAVITY), self._ball.step))
        for _ in range(3):  # Newton's method on the height
            if not 0 < time < LONGEST_FLIGHT_S:
                return None
            there, speed = travel(self._ball, air, place[None], velocity[None], np.array([time]))
            time -= float((there[0, 2] - self._floor) / speed[0, 2])
        there, _ = travel(self._ball, air, place[None], velocity[None], np.array([time]))
        return hit + time, there[0]
