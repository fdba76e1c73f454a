"""The striker without a bus: what it decides about each ball."""

import contextlib
import itertools
import logging
import math
import uuid
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, Protocol

import numpy as np

from protocol import messages as m
from protocol.errors import NoAnswer, Refusal
from robot.description import RobotConfig
from robot.striking.choice import Choice, NoHit, State
from robot.striking.estimator import NoBall
from services.common.logs import ThrottledLog
from services.striker.attempt import Asked, Attempt, Outcome
from services.striker.messages import READY, READY_S, goal_message, ready_goal, strike_message
from services.striker.mind import Mind
from services.striker.orders import Order, order_of
from services.striker.watching import Stillness

LOST_S = 0.15
"""A ball that was not seen for so long has stopped coming."""
MIN_SIGHTS = 5
"""Sights before a first choice: the spread at the hit is then below the racket's radius."""
CHOICE_PERIOD_S = 0.05
"""Between choices for a ball for which no hit was found."""
LEAD_S = 0.05
"""From now until a first motion begins: choosing, planning and the way to the arm."""
CORRECTION_LEAD_S = 0.015
TOUCH_WINDOW_S = 0.06
"""A contact so near to the planned touch is the hit."""
OUTGOING_SIGHTS = 12
"""Sights after the hit by which the outgoing ball is known."""
GIVE_UP_S = 0.5
"""After a planned touch; a ball that was not seen enough by then is not judged."""
SHOWN_S = 1.0
"""How far ahead a ball is shown for which there is no hit yet."""
RETRY_S = 1.0
"""Between attempts to go to the ready pose."""


class Outside(Protocol):
    """What the striker asks and says."""

    def ask(self, goal: m.Goal) -> None:
        """Send a goal; `Striker.answered` gets what comes of it."""
        ...

    def command(self) -> m.Command | None:
        """Return the controller's newest command, None where none came since the last call."""
        ...

    def say(self, strike: m.Strike) -> None:
        """Publish a decision."""
        ...


class Striker:
    """Strikes the balls that it sees, while it has an order. Times are the robot's.

    Methods named after what happens take it in; `decide` then does the next thing that is to be done.
    """

    def __init__(
        self,
        config: RobotConfig,
        mind: Mind,
        outside: Outside,
        library: Sequence[tuple[str, float]],
        log: logging.Logger,
        method: Literal["qp", "dmp"] = "qp",
    ) -> None:
        """`library`: name and duration (s) of this arm's primitives. `method`: of the goals."""
        self._config = config
        self._method: Literal["qp", "dmp"] = method
        self._mind = mind
        self._outside = outside
        self._strikes = tuple((name, duration) for name, duration in library if name != READY)
        self._home = READY if len(self._strikes) < len(library) else ""
        self._log = log
        self._rejected = ThrottledLog(log)
        self._order: Order | None = None
        self._left: int | None = None
        self._attempt: Attempt | None = None
        self._balls = itertools.count(1)
        self._goals = (f"strike-{uuid.uuid4().hex[:6]}-{number}" for number in itertools.count(1))
        self._stillness = Stillness()
        self._now = 0.0
        self._seen = -math.inf
        self._next = -math.inf
        self._begin: State | None = None
        self._away = False  # from the ready pose
        self._returning: str | None = None
        self._fault: str | None = None

    # --- requests -------------------------------------------------------------------------------------

    def order(self, request: m.StrikeRequest) -> m.Striking:
        """Strike from now on, as asked; what was asked before is forgotten.

        Raises:
            Refusal: `bad_message`, naming the field; `unknown_primitive`.
        """
        order = order_of(request)
        known = {name for name, _ in self._strikes}
        for name in order.primitives:
            if name not in known:
                sentence = f"there is no primitive {name!r}; the library has {', '.join(sorted(known))}"
                raise Refusal("unknown_primitive", sentence, name=name)
        if not self._strikes:
            raise Refusal("unknown_primitive", "the library has no primitive of this arm; teach it a strike", name="")
        self._order, self._left = order, request.count
        self._away = True  # for the first ball it waits in the ready pose
        self._log.info("strikes balls to %s", order.target.tolist())
        return m.Striking(active=True)

    def stop(self) -> m.Striking:
        """Strike no further ball; a motion under way is played to its end."""
        self._order, self._attempt = None, None
        return m.Striking(active=False)

    # --- what happens ---------------------------------------------------------------------------------

    def see(self, ball: m.BallState) -> None:
        """Take in where the ball was seen."""
        if ball.time < self._seen - LOST_S:  # a new run
            self._forget()
        self._now = max(self._now, ball.time)
        position = np.array(ball.position, dtype=float)
        if len(position) != 3:
            self._rejected.warn(f"a ball with {len(position)} coordinates was left out; space has 3")
            return
        attempt = self._attempt
        if attempt and attempt.stage in ("swinging", "struck") and attempt.choice and ball.time > attempt.choice.time:
            attempt.sights.append((ball.time, position))
            self._seen = ball.time
            return
        if self._stillness.is_still(ball.time, position):
            self._mind.estimator.reset()
            return
        velocity = None if ball.velocity is None else np.array(ball.velocity, dtype=float)
        sight = self._mind.estimator.observe(ball.time, position, velocity)
        if sight == "rejected":
            self._rejected.warn("a ball was seen where the one that is followed cannot be; it was left out")
        elif sight in ("started", "new ball") and attempt and attempt.stage in ("seen", "swinging"):
            self._miss(attempt, "another ball was seen" if sight == "new ball" else "the ball was lost")
        if sight != "rejected":
            self._seen = ball.time

    def touch(self, contact: m.Contact) -> None:
        """Take in that two bodies touched: the ball and the racket near the planned touch is the hit."""
        attempt = self._attempt
        if attempt is None or attempt.choice is None or attempt.touch is not None:
            return
        pair = {self._mind.ball_body, self._mind.racket_body}
        if set(contact.bodies) == pair and abs(contact.time - attempt.choice.time) < TOUCH_WINDOW_S:
            attempt.touch = contact

    def ended(self, result: m.Result) -> None:
        """Take in how a motion ended."""
        attempt = self._attempt
        if attempt and result.goal_id == attempt.goal_id and result.outcome == "aborted":
            self._miss(attempt, f"the swing was aborted: {result.reason}")

    def note(self, status: m.Status) -> None:
        """Take in the controller's status: the time, and whether it is in fault."""
        if status.time < self._now - 1.0:
            self._forget()
        self._now = max(self._now, status.time)
        self._fault = status.fault

    def answered(self, goal_id: str, reply: m.GoalReply | Refusal | NoAnswer) -> None:
        """Take in what came of a goal."""
        if goal_id == self._returning:
            self._returned(reply)
            return
        attempt = self._attempt
        if attempt is None or attempt.asked is None or attempt.asked.goal_id != goal_id:
            return  # of a ball that is forgotten: the motion ends at rest
        asked, attempt.asked = attempt.asked, None
        if isinstance(reply, m.GoalReply):
            self._play(attempt, asked, reply)
        else:
            self._refused(attempt, asked, reply)

    # --- decisions ------------------------------------------------------------------------------------

    def decide(self) -> None:
        """Do what is to be done now, if anything."""
        self._take_command()
        if self._attempt is None or self._attempt.stage == "over":
            self._notice()
        attempt = self._attempt
        if attempt is None or (attempt.stage in ("struck", "over") and self._now > attempt.rest_time):
            self._go_ready()
        if attempt is None:
            return
        if attempt.stage == "seen":
            self._choose(attempt)
        elif attempt.stage == "swinging":
            self._follow(attempt)
        elif attempt.stage == "struck":
            self._judge(attempt)

    def give_up(self, reason: str) -> None:
        """Let the ball go; the motion under way is played to its end."""
        if self._attempt and self._attempt.stage != "over":
            self._attempt.stage, self._attempt.asked = "over", None
            self._say(self._attempt, "missed", reason)
        self._mind.estimator.reset()

    def _notice(self) -> None:
        """Begin an attempt for a ball that is known well enough and comes towards the arm."""
        estimate = self._mind.estimator.estimate
        if self._order is None or self._left == 0 or estimate is None or estimate.sights < MIN_SIGHTS:
            return
        if self._mind.estimator.age(self._now) > LOST_S or not self._mind.comes(estimate):
            return
        self._attempt = Attempt(next(self._balls), rest_time=self._attempt.rest_time if self._attempt else 0.0)
        self._say(self._attempt, "seen")

    def _choose(self, attempt: Attempt) -> None:
        """Choose a first hit, once the ball is known well enough, and ask for it."""
        estimate = self._mind.estimator.estimate
        if self._order is None or estimate is None or attempt.asked is not None:
            return
        if self._mind.estimator.age(self._now) > LOST_S:
            self._miss(attempt, f"the ball was not seen for {LOST_S} s")
            return
        if estimate.time <= attempt.decided or self._now < attempt.again:
            return
        begin = self._start(LEAD_S)
        if begin is None:
            return
        attempt.decided, attempt.again = estimate.time, self._now + CHOICE_PERIOD_S
        try:
            choices = self._mind.choose(begin, self._order)
        except NoHit as reason:
            self._say(attempt, "refused", str(reason))
            return
        attempt.further = iter(choices)
        self._ask_next(attempt)

    def _ask_next(self, attempt: Attempt) -> None:
        """Ask for the next of the hits that were found."""
        choice = next(attempt.further, None)
        if choice is None or self._order is None:
            return
        attempt.primitive = self._primitive_for(choice.goal_time - self._now)
        self._ask(attempt, choice, None)

    def _ask(self, attempt: Attempt, choice: Choice, revises: str | None) -> None:
        attempt.asked = Asked(next(self._goals), choice, revises)
        self._away = True
        goal = goal_message(attempt.asked, attempt.primitive, self._mind.follow_through, self._method)
        self._outside.ask(goal)

    def _primitive_for(self, left: float) -> str:
        """Return the primitive whose demonstration lasts most nearly the time that is left, s."""
        assert self._order is not None
        allowed = self._order.primitives
        own = [(name, duration) for name, duration in self._strikes if name in allowed or not allowed]
        return min(own, key=lambda entry: abs(math.log(entry[1] / max(left, 1e-3))))[0]

    def _play(self, attempt: Attempt, asked: Asked, reply: m.GoalReply) -> None:
        """A hit was accepted, or a correction of it."""
        attempt.goal_id, attempt.choice, attempt.stage = reply.goal_id, asked.choice, "swinging"
        attempt.rest_time = reply.start_time + reply.total_duration
        attempt.reason = ""
        if asked.revises is not None:
            attempt.choice = self._mind.rehearsed(asked.choice)
            attempt.revisions += 1
        self._say(attempt, "planned" if asked.revises is None else "revised")

    def _refused(self, attempt: Attempt, asked: Asked, reason: Refusal | NoAnswer) -> None:
        """A hit was refused: try the next one. A correction was: the arm plays what it has."""
        self._say(attempt, "refused", str(reason))
        if asked.revises is None:
            if isinstance(reason, Refusal) and reason.code not in ("fault", "busy", "not_holder", "unavailable"):
                self._ask_next(attempt)
        elif isinstance(reason, Refusal) and reason.code in ("superseded", "unknown_goal"):
            self._miss(attempt, f"the swing was replaced: {reason}")

    def _follow(self, attempt: Attempt) -> None:
        """Correct the hit, until shortly before the touch."""
        choice, estimate, order = attempt.choice, self._mind.estimator.estimate, self._order
        assert choice is not None
        if self._now > choice.time:
            attempt.stage = "struck"
            return
        if order is None or estimate is None or attempt.asked is not None or self._now > choice.time - order.until:
            return
        if estimate.time < attempt.decided + max(order.period, 1e-3) - 1e-6:
            return
        begin = self._start(CORRECTION_LEAD_S)
        if begin is None:
            return
        attempt.decided = estimate.time
        try:
            better = self._mind.correct(begin, order, choice)
        except NoHit as reason:
            self._say(attempt, "refused", str(reason))
            return
        self._ask(attempt, better, attempt.goal_id)

    def _judge(self, attempt: Attempt) -> None:
        """Say whether the ball was hit and where it lands, and learn from it, once enough of it was seen."""
        choice = attempt.choice
        assert choice is not None
        late = self._now > choice.time + GIVE_UP_S
        if len(attempt.sights) < OUTGOING_SIGHTS and not late:
            return
        attempt.stage = "over"
        if self._left is not None:
            self._left = max(0, self._left - 1)
        outcome = self._mind.judge(attempt)
        if outcome is None:
            self._say(
                attempt, "missed", "the ball went by the racket" if attempt.sights else "the ball was not seen again"
            )
        else:
            self._say(attempt, "hit", outcome=outcome)
            if outcome.landing is not None:
                self._say(attempt, "landed", outcome=outcome)
        self._mind.estimator.reset()
        self._stillness.reset()
        if self._left == 0:
            self._order = None

    def _go_ready(self) -> None:
        """Send the arm back to where it waits for balls."""
        if not self._away or self._returning or self._order is None or self._fault or self._now < self._next:
            return
        self._next = self._now + RETRY_S
        self._returning = next(self._goals)
        primitive = self._home or self._primitive_for(READY_S)
        self._outside.ask(ready_goal(self._returning, self._config, primitive))

    def _returned(self, reply: m.GoalReply | Refusal | NoAnswer) -> None:
        self._returning = None
        if isinstance(reply, m.GoalReply):
            self._away, self._next = False, -math.inf
        else:
            self._log.warning("cannot go to the ready pose: %s; tries again in %.0f s", reply, RETRY_S)

    # --- time and place -------------------------------------------------------------------------------

    def _take_command(self) -> None:
        command = self._outside.command()
        if command is None:
            return
        time = command.tick / self._config.rate_hz
        if self._begin is not None and time < self._begin.time - 1.0:
            self._forget()
        self._now = max(self._now, time)
        accelerations = command.feedforward if command.feedforward is not None else command.accelerations
        self._begin = State(
            time, *(np.array(values) for values in (command.positions, command.velocities, accelerations))
        )

    def _start(self, lead: float) -> State | None:
        """Return where a motion begins that is asked for now; None while the controller is not known."""
        begin = self._begin
        if begin is None or self._now - begin.time > 1.0:
            return None
        ahead = max(0.0, self._now - begin.time) + lead
        return replace(
            begin,
            time=begin.time + ahead,
            positions=begin.positions + ahead * begin.velocities + ahead**2 / 2 * begin.accelerations,
            velocities=begin.velocities + ahead * begin.accelerations,
        )

    def _forget(self) -> None:
        """A new run has begun: nothing of the one before counts."""
        self._mind.estimator.reset()
        self._stillness.reset()
        self._attempt, self._returning, self._begin = None, None, None
        self._now, self._seen, self._next = 0.0, -math.inf, -math.inf

    def _miss(self, attempt: Attempt, reason: str) -> None:
        """The ball is over without a hit; publish why."""
        self._say(attempt, "missed", reason)
        attempt.stage = "over"

    def _say(self, attempt: Attempt, phase: m.StrikePhase, reason: str = "", outcome: Outcome | None = None) -> None:
        """Publish a decision; the same reason is not repeated."""
        if phase == "refused" and reason == attempt.reason:
            return
        attempt.reason = reason
        level = logging.WARNING if phase in ("refused", "missed") else logging.INFO
        if phase != "revised":
            self._log.log(level, "ball %d %s%s", attempt.ball, phase, f": {reason}" if reason else "")
        path = None
        if phase in ("seen", "planned", "revised", "refused"):
            until = attempt.choice.time if attempt.choice else self._now + SHOWN_S
            with contextlib.suppress(NoBall):
                path = self._mind.estimator.path(until)
        self._outside.say(strike_message(attempt, phase, self._now, path, reason, outcome))
