"""The hit of a ball: choose it, request it in time, correct it."""

from collections import deque
from collections.abc import Callable, Iterator

from protocol import messages as m
from protocol.errors import Refusal
from robot.striking.choice import Choice, NoHit
from robot.striking.estimator import Estimate
from services.striker.attempt import Asked, Attempt
from services.striker.clock import Clock
from services.striker.messages import Method, goal_message
from services.striker.mind import Mind
from services.striker.orders import Order
from services.striker.outside import Reply, Taken
from services.striker.repertoire import Repertoire
from services.striker.voice import Voice

CHOICE_PERIOD_S = 0.05
"""Time between choices for a ball without a hit, s."""
LEAD_S, CORRECTION_LEAD_S = 0.05, 0.015
"""Leads from a decision to the begin of its motion, before any is measured: of a first hit and of a correction, s."""
SOONEST_S = 0.1
"""A hit sooner than this is not requested: the choice took too long. s."""
HOPELESS = ("fault", "busy", "not_holder", "unavailable")
"""Refusals that every goal would get now."""
REPLACED = ("superseded", "unknown_goal")
"""Refusals of a correction whose motion is no longer played."""


LONGEST_S = 0.3
REMEMBERED = 8


class RecentLead:
    """The time (s) from a decision to the begin of its motion: the second longest of recent ones, or `initial`."""

    def __init__(self, initial: float) -> None:
        self._recent = deque([initial, initial], maxlen=REMEMBERED)

    def note(self, seconds: float) -> None:
        """Record the time of one decision."""
        self._recent.append(min(max(seconds, 0.0), LONGEST_S))

    def seconds(self) -> float:
        """Return the lead of the next decision."""
        return sorted(self._recent)[-2]


class Swing:
    """Finds the hit of an attempt and requests it with `ask`; pass the reply to `answered`."""

    def __init__(
        self,
        mind: Mind,
        clock: Clock,
        repertoire: Repertoire,
        voice: Voice,
        ask: Callable[[m.Goal], object],
        names: Iterator[str],
        method: Method,
    ) -> None:
        self._mind = mind
        self._clock = clock
        self._repertoire = repertoire
        self._voice = voice
        self._send = ask
        self._names = names
        self._method: Method = method
        self._lead = RecentLead(LEAD_S), RecentLead(CORRECTION_LEAD_S)

    def choose(self, attempt: Attempt, order: Order, ball: Estimate) -> None:
        """Choose a first hit of a ball and request it, if there are new sights since the last choice."""
        now = self._clock.now
        if attempt.asked is not None or ball.time <= attempt.decided or now < attempt.again:
            return
        begin = self._clock.start(self._lead[0].seconds())
        if begin is None:
            return
        attempt.decided, attempt.again, attempt.began = ball.time, now + CHOICE_PERIOD_S, now
        try:
            choices = self._mind.choose(begin, order)
        except NoHit as reason:
            self._voice.refuse(attempt, now, reason)
            return
        attempt.further = choices
        self._ask_next(attempt, order.primitives)

    def correct(self, attempt: Attempt, order: Order, ball: Estimate) -> None:
        """Correct the hit with the newest sight, at most once a period, until shortly before the touch."""
        choice, now = attempt.choice, self._clock.now
        assert choice is not None
        if attempt.asked is not None or now > choice.time - order.until:
            return
        if ball.time < attempt.decided + max(order.period, 1e-3) - 1e-6:
            return
        begin = self._clock.start(self._lead[1].seconds())
        if begin is None:
            return
        attempt.decided, attempt.began = ball.time, now
        attempt.further = self._mind.correct(begin, order, choice)
        try:
            better = next(attempt.further)
        except NoHit as reason:
            self._voice.refuse(attempt, now, reason)
            return
        self._ask(attempt, better, attempt.goal_id)

    def answered(self, attempt: Attempt, primitives: tuple[str, ...], reply: Reply) -> None:
        """Process the reply to the requested goal."""
        asked, attempt.asked = attempt.asked, None
        assert asked is not None
        if isinstance(reply, Taken):
            self._play(attempt, asked, reply)
            return
        now = self._clock.now
        self._voice.refuse(attempt, now, reply)
        code = reply.code if isinstance(reply, Refusal) else "unavailable"
        if asked.revises is None:
            if code not in HOPELESS:
                self._ask_next(attempt, primitives)
        elif code in REPLACED:
            self._voice.miss(attempt, now, f"the swing was replaced: {reply}")
        elif code not in HOPELESS and (touch := next(attempt.further, None)) is not None:
            attempt.began = now
            self._ask(attempt, touch, asked.revises)

    def _play(self, attempt: Attempt, asked: Asked, reply: Taken) -> None:
        """Adopt an accepted hit or correction."""
        attempt.goal_id, attempt.choice, attempt.stage = reply.goal_id, asked.choice, "swinging"
        attempt.rest_time = reply.rest_time
        attempt.reason = attempt.refused_for = ""
        attempt.revisions += asked.revises is not None
        self._lead[asked.revises is not None].note(reply.start_time - attempt.began)
        self._voice.say(attempt, "planned" if asked.revises is None else "revised", self._clock.now)
        if asked.revises is not None:
            attempt.choice = self._mind.rehearsed(asked.choice)

    def _ask_next(self, attempt: Attempt, primitives: tuple[str, ...]) -> None:
        """Request the next found hit for which there is still time; without one, `choose` searches again."""
        choice = next((c for c in attempt.further if c.goal_time > self._clock.now + SOONEST_S), None)
        if choice is not None:
            attempt.primitive = self._repertoire.nearest(choice.goal_time - self._clock.now, primitives)
            self._ask(attempt, choice, None)

    def _ask(self, attempt: Attempt, choice: Choice, revises: str | None) -> None:
        attempt.asked = Asked(next(self._names), choice, revises)
        self._send(goal_message(attempt.asked, attempt.primitive, self._mind.follow_through, self._method))
