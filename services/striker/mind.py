"""The striker's knowledge and mathematics: ball, court, arm, contact law. Arrays in, hits out."""

import logging
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np

from robot.court import BALL, CourtConfig
from robot.description import RobotConfig
from robot.model import owner_name
from robot.striking.arm import Arm, Racket
from robot.striking.calibration import calibrate
from robot.striking.choice import Choice, NoHit, State, distinct_first
from robot.striking.chooser import Chooser
from robot.striking.contact import ContactLaw
from robot.striking.corrections import Corrections
from robot.striking.estimator import Belief, Estimate, Estimator
from robot.striking.flight import Ball, Court, Net, Surface
from robot.striking.learning import Learner, LearningError, read
from robot.striking.options import Options
from robot.striking.reachability import Reachability
from robot.striking.recoil import Recoil
from robot.striking.simulated_contact import SimulatedContact
from services.striker.attempt import Attempt, Outcome
from services.striker.judging import Judge
from services.striker.orders import Order

HORIZON_S = 2.0
"""Prediction horizon of a ball, s."""
FOLLOW_THROUGH_S = 0.015
"""s for which the racket keeps its velocity after the contact."""
CLEARS_M = 0.15
"""Clearance above the net for a returned ball, m."""
BELIEVED = Belief(position_std=0.004, velocity_std=0.02, restitution_std=0.06, drag_std=0.2)
CANDIDATES, ASKED = 40, 12
"""Number of first hits to find, and how many of them are requested before hits are chosen again."""
TOUCHED = "out of reach", "room"
"""Reasons of NoHit after which a ball may at least be touched."""
BLOCK_S = 0.5
"""s; a ball that arrives later is not blocked yet, since further sights may allow a hit."""
OPTIONS = Options(
    time_step=0.04,
    flights=(0.6, 0.75, 0.9),
    most=120,
    time_shifts=(-0.02, 0.0, 0.02),
    flight_shifts=(-0.05, 0.0, 0.05),
)
"""Fewer candidates than the mathematics' own: a correction must be found between two sights."""


class CannotStrike(ValueError):
    """The robot's description lacks something that striking needs; `str()` is a sentence."""


class Mind:
    """Predicts the ball, chooses hits and corrects them, and learns the contact law from the balls that leave.

    Attributes:
        estimator: Follows the ball.
        ball_body: Name of the ball in contacts.
        racket_body: Name of the racket in contacts.
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
        step = float(config.model.opt.timestep)
        ball = Ball(config.ball.mass, config.ball.radius, config.ball.drag, config.ball.magnus, step)
        court = court_of(config.court)
        arm = Arm(config, Racket(config.racket.radius, config.racket.thickness), ball)
        table = Reachability.of(config, learned.parent)
        try:
            known = read(learned, config.name)
        except LearningError as error:
            raise CannotStrike(str(error)) from None
        contact = SimulatedContact(config, BALL, ContactLaw(0.0, 0.0), arm.offset, alpha=config.alpha)
        calibrated = calibrate(arm, table, contact).law
        self._learner = known or Learner.of(calibrated)
        # The simulated contact is compared with the calibrated law, so that the learned corrections add to it.
        contact.law = calibrated
        self.follow_through = self._learner.law.duration / 2 + FOLLOW_THROUGH_S
        options = replace(OPTIONS, follow_through=self.follow_through)
        self._chooser = Chooser(arm, table, court, self._learner.law, options, contact, Recoil(arm).has_room)
        self._judge = Judge(ball, court, self._learner, learned, config.name, log)
        self._centre = arm.chain.pose(config.home[None])[0][0]
        self.estimator = Estimator(ball, court, BELIEVED)
        self._corrections = Corrections(self._chooser, self.estimator, tries=1)
        self.ball_body = BALL
        self.racket_body = owner_name(config.model, config.model.geom(config.racket.geom).id)

    def comes(self, estimate: Estimate) -> bool:
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
            if reason.reason not in TOUCHED:
                raise
            found = list(self._chooser.blocks(path, begin, order.target, count=CANDIDATES))
            if min(block.time for block in found) > begin.time + BLOCK_S:
                raise
        return islice(distinct_first(found), ASKED)

    def correct(self, begin: State, order: Order, last: Choice) -> Iterator[Choice]:
        """Yield better hits than `last`, then hits that at least touch the ball; see `Corrections`. Raises NoHit."""
        return self._corrections.of(last, begin, order.target)

    def rehearsed(self, choice: Choice) -> Choice:
        """Return a correction that is played with its simulated contact, which the next correction uses."""
        return self._chooser.rehearsed(choice)

    def judge(self, attempt: Attempt) -> Outcome | None:
        """Return how the ball left the hit, and learn from it; None if it was not hit."""
        outcome = self._judge.judge(attempt)
        self._chooser.law = self._learner.law
        return outcome


def court_of(config: CourtConfig) -> Court:
    """Convert a robot's court to that of `robot.striking`."""
    surface = Surface(config.height, config.restitution, config.friction, config.dwell)
    if config.net is None:
        return Court(surface)
    net = Net(np.array(config.net.top), np.array(config.net.normal), config.net.half_width)
    return Court(surface, net, clearance=CLEARS_M)
