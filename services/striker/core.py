"""The striker without a bus: decisions about each ball."""

import itertools
import logging
import uuid
from collections.abc import Sequence

from protocol import messages as m
from robot.description import RobotConfig
from services.striker.attempt import Attempt
from services.striker.clock import Clock
from services.striker.eyes import LOST_S, Eyes
from services.striker.homing import Homing
from services.striker.messages import Method
from services.striker.mind import Mind
from services.striker.orders import Order, order_of
from services.striker.outside import Outside, Reply
from services.striker.repertoire import Repertoire
from services.striker.swing import Swing
from services.striker.voice import Voice

MIN_SIGHTS = 5
"""Sights before a first choice: then the standard deviation at the hit is below the racket's radius."""
TOUCH_WINDOW_S = 0.06
"""A contact within this time of the planned touch is the hit, s."""


class Striker:
    """Strikes the balls that it sees while it has an order. Times are the robot's.

    Methods named after events process them; `decide` then takes the next action.
    """

    def __init__(
        self,
        config: RobotConfig,
        mind: Mind,
        outside: Outside,
        library: Sequence[tuple[str, float]],
        log: logging.Logger,
        method: Method = "qp",
    ) -> None:
        """`library`: name and duration (s) of this arm's primitives. `method`: of the goals."""
        self._mind = mind
        self._outside = outside
        self._log = log
        self._names = (f"strike-{uuid.uuid4().hex[:6]}-{number}" for number in itertools.count(1))
        self._balls = itertools.count(1)
        self._clock = Clock(config.rate_hz)
        self._eyes = Eyes(mind.estimator, log)
        self._voice = Voice(outside.say, mind.estimator, log)
        self._repertoire = Repertoire(library)
        self._homing = Homing(config, self._repertoire, outside.ask, log)
        self._swing = Swing(mind, self._clock, self._repertoire, self._voice, outside.ask, self._names, method)
        self._order: Order | None = None
        self._left: int | None = None
        self._attempt: Attempt | None = None
        self._fault: str | None = None

    def order(self, request: m.StrikeRequest) -> m.Striking:
        """Start to strike as requested; this replaces an earlier order.

        Raises:
            Refusal: `bad_message`, naming the field; `unknown_primitive`.
        """
        order = order_of(request)
        self._repertoire.check(order.primitives)
        if self._order is None:
            self._homing.away = True  # so that it waits for the first ball in the ready pose
        self._order, self._left = order, request.count
        self._log.info("strikes balls to %s", order.target.tolist())
        return m.Striking(active=True)

    def stop(self) -> m.Striking:
        """Strike no further ball; the present motion is played to its end."""
        self._order, self._attempt = None, None
        return m.Striking(active=False)

    def see(self, ball: m.BallState) -> None:
        """Process a sight of the ball."""
        self._take_command()
        position = self._eyes.read(ball, self._clock.now)
        if position is None:
            return
        attempt = self._attempt
        if attempt and attempt.stage in ("swinging", "struck") and attempt.choice and ball.time > attempt.choice.time:
            attempt.sights.append((ball.time, position))
            return
        over = self._eyes.follow(ball, position)
        if over and attempt and attempt.stage in ("seen", "swinging"):
            self._voice.miss(attempt, self._clock.now, over)

    def touch(self, contact: m.Contact) -> None:
        """Process a contact: the ball and the racket near the planned touch are the hit."""
        attempt = self._attempt
        if attempt is None or attempt.choice is None or attempt.touch is not None:
            return
        pair = {self._mind.ball_body, self._mind.racket_body}
        if set(contact.bodies) == pair and abs(contact.time - attempt.choice.time) < TOUCH_WINDOW_S:
            attempt.touch = contact

    def ended(self, result: m.Result) -> None:
        """Process the result of a motion."""
        attempt = self._attempt
        if attempt and result.goal_id == attempt.goal_id and result.outcome == "aborted":
            self._voice.miss(attempt, self._clock.now, f"the swing was aborted: {result.reason}")

    def note(self, status: m.Status) -> None:
        """Process the controller's status: whether it is in fault."""
        self._fault = status.fault

    def answered(self, goal_id: str, reply: Reply) -> None:
        """Process the reply to a goal; replies for earlier balls are ignored, and their motions end at rest."""
        attempt = self._attempt
        if self._homing.answered(goal_id, reply) or attempt is None:
            return
        if attempt.asked is not None and attempt.asked.goal_id == goal_id:
            self._homing.away = True
            self._swing.answered(attempt, self._order.primitives if self._order else (), reply)

    def decide(self) -> None:
        """Take the next action, if any."""
        self._take_command()
        if self._order is not None:
            if self._attempt is None or self._attempt.stage == "over":
                self._notice(self._order)
            self._go_home(self._order)
        attempt = self._attempt
        if attempt is None:
            return
        if attempt.stage == "swinging" and attempt.choice and self._clock.now > attempt.choice.time:
            attempt.stage = "struck"
        if attempt.stage == "struck":
            self._judge(attempt)
        elif attempt.stage != "over":
            self._aim(attempt)

    def give_up(self, reason: str) -> None:
        """Abandon the ball; the present motion is played to its end."""
        if self._attempt and self._attempt.stage != "over":
            self._voice.miss(self._attempt, self._clock.now, reason)
        self._eyes.forget()

    def _notice(self, order: Order) -> None:
        """Begin an attempt for a ball that is known well enough and comes towards the arm."""
        ball = self._eyes.ball(self._clock.now)
        if self._left == 0 or ball is None or ball.sights < MIN_SIGHTS or not self._mind.comes(ball):
            return
        self._attempt = Attempt(next(self._balls), rest_time=self._attempt.rest_time if self._attempt else 0.0)
        self._voice.say(self._attempt, "seen", self._clock.now)

    def _go_home(self, order: Order) -> None:
        """Send the arm to the ready pose, once the motion of the last ball is over."""
        attempt, now = self._attempt, self._clock.now
        is_free = attempt is None or (attempt.stage in ("struck", "over") and now > attempt.rest_time)
        if is_free and not self._fault:
            self._homing.go(now, self._names, order.primitives)

    def _aim(self, attempt: Attempt) -> None:
        """Choose a hit of an approaching ball, or correct it."""
        ball = self._eyes.ball(self._clock.now)
        if self._order is None:
            return
        if attempt.stage == "seen" and ball is None:
            self._voice.miss(attempt, self._clock.now, f"the ball was not seen for {LOST_S} s")
        elif attempt.stage == "seen" and ball is not None and attempt.asked is None and not self._mind.comes(ball):
            self._voice.miss(attempt, self._clock.now, attempt.reason or "it went by before a hit was found")
        elif ball is not None:
            aim = self._swing.choose if attempt.stage == "seen" else self._swing.correct
            aim(attempt, self._order, ball)

    def _judge(self, attempt: Attempt) -> None:
        """Publish whether the ball was hit and where it lands, and learn from it, once there are enough sights."""
        now = self._clock.now
        if not attempt.has_flown(now):
            return
        attempt.stage = "over"
        if self._left is not None:
            self._left = max(0, self._left - 1)
        outcome = self._mind.judge(attempt)
        if outcome is None:
            reason = "the ball went by the racket" if attempt.sights else "the ball was not seen again"
            self._voice.miss(attempt, now, reason)
        else:
            self._voice.say(attempt, "hit", now, outcome=outcome)
            if outcome.landing is not None:
                self._voice.say(attempt, "landed", now, outcome=outcome)
        self._eyes.forget()
        if self._left == 0:
            self._order = None

    def _take_command(self) -> None:
        """Process the controller's newest command; a new run discards the state of the last one."""
        command = self._outside.command()
        if command is not None and self._clock.take(command):
            self._eyes.forget(new_run=True)
            self._homing.forget()
            self._attempt = None
