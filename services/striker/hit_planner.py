"""Predict the ball, plan and correct hits, and learn the contact law: the striker's mathematics, without a bus."""

import logging
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np

from protocol.messages import Contact
from robot.court import BALL
from robot.description import RobotConfig
from robot.model import owner_name
from robot.striking.arm import Arm, Racket
from robot.striking.calibration import calibrate
from robot.striking.choice import Choice, NoHit, State, distinct_first
from robot.striking.chooser import Chooser
from robot.striking.conversions import ball_of, court_of
from robot.striking.corrections import Corrections
from robot.striking.estimator import Estimate, Estimator, NoiseModel
from robot.striking.learning import Learner, LearningError, read
from robot.striking.options import Options
from robot.striking.reachability import Reachability
from robot.striking.recoil import Recoil
from robot.striking.simulated_contact import SimulatedContact
from services.striker.attempt import Attempt
from services.striker.orders import Order
from services.striker.outcomes import Outcome, OutcomeEvaluator

MIN_SIGHTS = 5
"""Sights before a first choice: then the standard deviation at the hit is below the racket's radius."""
HORIZON_S = 2.0
"""Prediction horizon of a ball, s."""
FOLLOW_THROUGH_S = 0.015
"""s for which the racket keeps its velocity after the contact."""
NET_CLEARANCE_M = 0.15
"""Clearance above the net for a returned ball, m."""
CONTACT_WINDOW_S = 0.06
"""A contact within this time of the planned touch is the hit, s."""
NOISE = NoiseModel(position_std=0.004, velocity_std=0.02, restitution_std=0.06, drag_std=0.2)
CANDIDATES, REQUESTED = 40, 12
"""Number of first hits to find, and how many of them are requested before hits are chosen again."""
BLOCKABLE = "out of reach", "room"
"""Reasons of NoHit after which a ball may at least be blocked."""
BLOCK_S = 0.5
"""s; a ball that arrives later is not blocked yet, since further sights may allow a hit."""
OPTIONS = Options(
    time_step=0.04,
    flights=(0.6, 0.75, 0.9),
    max_candidates=120,
    time_shifts=(-0.02, 0.0, 0.02),
    flight_shifts=(-0.05, 0.0, 0.05),
)
"""Fewer candidates than the mathematics' own: a correction must be found between two sights."""


class CannotStrike(ValueError):
    """The robot's description lacks something that striking needs; `str()` is a sentence."""


class HitPlanner:
    """Predicts the ball, chooses hits and corrects them, and learns the contact law from the balls that leave.

    Attributes:
        estimator: Follows the ball.
        follow_through: s for which the arm keeps its velocities after the middle of the contact.
    """

    def __init__(self, config: RobotConfig, learned: Path, log: logging.Logger) -> None:
        """Prepare. The first time for a robot takes seconds; later the table is read from beside `learned`.

        Raises:
            CannotStrike: the description has no ball, racket or court, or the learned law cannot be read.
        """
        if config.ball is None or config.racket is None or config.court is None:
            missing = [name for name in ("ball", "racket", "court") if getattr(config, name) is None]
            raise CannotStrike(f"robot {config.name} cannot strike: its TOML has no [{'], ['.join(missing)}]")
        ball, court = ball_of(config), court_of(config.court, NET_CLEARANCE_M)
        arm = Arm(config, Racket(config.racket.radius, config.racket.thickness), ball)
        table = Reachability.of(config, learned.parent)
        try:
            known = read(learned, config.name)
        except LearningError as error:
            raise CannotStrike(str(error)) from None
        contact = SimulatedContact(config, BALL, alpha=config.alpha)
        # The simulated contact is compared with the calibrated law, so that the learned corrections add to it.
        contact.law = calibrate(arm, table, contact).law
        self._learner = known or Learner.of(contact.law)
        self.follow_through = self._learner.law.duration / 2 + FOLLOW_THROUGH_S
        options = replace(OPTIONS, follow_through=self.follow_through)
        self._chooser = Chooser(arm, table, court, self._learner.law, options, contact, Recoil(arm).has_room)
        self._outcomes = OutcomeEvaluator(ball, court, self._learner, learned, config.name, log)
        self._centre = arm.chain.pose(config.home[None])[0][0]
        self.estimator = Estimator(ball, court, NOISE)
        self._corrections = Corrections(self._chooser, self.estimator, tries=1)
        self._hit_bodies = {BALL, owner_name(config.model, config.model.geom(config.racket.geom).id)}

    def is_approaching(self, estimate: Estimate) -> bool:
        """Return whether a ball moves towards the arm."""
        towards = self._centre[:2] - estimate.position[:2]
        return bool(estimate.velocity[:2] @ towards > 0.5 * np.linalg.norm(towards))

    def choose(self, begin: State, order: Order) -> Iterator[Choice]:
        """Return hits of the followed ball, the best first; if there are none, hits that at least touch it.

        Raises NoHit.
        """
        path = self.estimator.path(begin.time + HORIZON_S)
        try:
            found = self._chooser.choose(path, begin, order.target, order.flight_time, count=CANDIDATES)
        except NoHit as reason:
            if reason.reason not in BLOCKABLE:
                raise
            found = list(self._chooser.blocks(path, begin, order.target, count=CANDIDATES))
            if min(block.time for block in found) > begin.time + BLOCK_S:
                raise
        return islice(distinct_first(found), REQUESTED)

    def correct(self, begin: State, order: Order, last: Choice) -> Iterator[Choice]:
        """Yield better hits than `last`, then hits that at least touch the ball; see `Corrections`. Raises NoHit."""
        return self._corrections.of(last, begin, order.target)

    def with_simulated_contact(self, choice: Choice) -> Choice:
        """Return a correction that is played with its simulated contact, which the next correction uses."""
        return self._chooser.with_simulated_contact(choice)

    def note_contact(self, attempt: Attempt, contact: Contact) -> None:
        """Record the first contact of ball and racket near the planned touch."""
        if attempt.choice is None or attempt.contact is not None:
            return
        if set(contact.bodies) == self._hit_bodies and abs(contact.time - attempt.choice.time) < CONTACT_WINDOW_S:
            attempt.contact = contact

    def evaluate(self, attempt: Attempt) -> Outcome | None:
        """Return how the ball left the hit, and learn from it; None if it was not hit."""
        outcome = self._outcomes.evaluate(attempt)
        self._chooser.law = self._learner.law
        return outcome
