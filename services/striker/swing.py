"""The hit of a ball: choose it, request it in time, correct it."""

from collections import deque
from collections.abc import Callable, Iterator

from protocol import messages as m
from protocol.errors import Refusal
from robot.striking.choice import Choice, NoHit
from robot.striking.estimator import Estimate
from services.striker.attempt import Attempt, PendingGoal
from services.striker.clock import Clock
from services.striker.hit_planner import HitPlanner
from services.striker.link import AcceptedGoal, Reply
from services.striker.messages import Method, goal_message
from services.striker.orders import Order
from services.striker.primitives import StrikePrimitives
from services.striker.publications import DecisionPublisher

CHOICE_PERIOD_S = 0.05
"""Time between choices for a ball without a hit, s."""
LEAD_S, CORRECTION_LEAD_S = 0.05, 0.015
"""Leads from a decision to the begin of its motion, before any is measured: of a first hit and of a correction, s."""
MIN_TIME_S = 0.1
"""A hit sooner than this is not requested: the choice took too long. s."""
GENERAL_REFUSALS = ("fault", "busy", "not_holder", "unavailable")
"""Refusals that every goal would get now."""
REPLACED_REFUSALS = ("superseded", "unknown_goal")
"""Refusals of a correction whose motion is no longer played."""
MAX_LEAD_S, REMEMBERED = 0.3, 8
"""Largest lead, s, and number of remembered leads."""


class RecentLead:
    """The time (s) from a decision to the begin of its motion: the second longest of recent ones, or `initial`."""

    def __init__(self, initial: float) -> None:
        self._recent = deque([initial, initial], maxlen=REMEMBERED)

    def note(self, seconds: float) -> None:
        """Record the time of one decision."""
        self._recent.append(min(max(seconds, 0.0), MAX_LEAD_S))

    def seconds(self) -> float:
        """Return the lead of the next decision."""
        return sorted(self._recent)[-2]


class Swing:
    """Finds the hit of an attempt and requests it with `send_goal`; pass the reply to `handle_reply`."""

    def __init__(
        self,
        hit_planner: HitPlanner,
        clock: Clock,
        primitives: StrikePrimitives,
        publisher: DecisionPublisher,
        send_goal: Callable[[m.Goal], object],
        goal_ids: Iterator[str],
        method: Method,
    ) -> None:
        self._hit_planner = hit_planner
        self._clock = clock
        self._primitives = primitives
        self._publisher = publisher
        self._send_goal = send_goal
        self._goal_ids = goal_ids
        self._method: Method = method
        self._leads = RecentLead(LEAD_S), RecentLead(CORRECTION_LEAD_S)

    def choose(self, attempt: Attempt, order: Order, ball: Estimate) -> None:
        """Choose a first hit of a ball and request it, if there are new sights since the last choice."""
        now = self._clock.now
        if attempt.pending is not None or ball.time <= attempt.sight_time or now < attempt.next_search:
            return
        begin = self._clock.state_after(self._leads[0].seconds())
        if begin is None:
            return
        attempt.sight_time, attempt.next_search, attempt.decision_time = ball.time, now + CHOICE_PERIOD_S, now
        try:
            choices = self._hit_planner.choose(begin, order)
        except NoHit as reason:
            self._publisher.publish_refusal(attempt, now, reason)
            return
        attempt.candidates = choices
        self._request_next(attempt, order.primitives)

    def correct(self, attempt: Attempt, order: Order, ball: Estimate) -> None:
        """Correct the hit with the newest sight, at most once a period, until shortly before the touch."""
        choice, now = attempt.choice, self._clock.now
        assert choice is not None
        if attempt.pending is not None or now > choice.time - order.until:
            return
        if ball.time < attempt.sight_time + max(order.period, 1e-3) - 1e-6:
            return
        begin = self._clock.state_after(self._leads[1].seconds())
        if begin is None:
            return
        attempt.sight_time, attempt.decision_time = ball.time, now
        attempt.candidates = self._hit_planner.correct(begin, order, choice)
        try:
            better = next(attempt.candidates)
        except NoHit as reason:
            self._publisher.publish_refusal(attempt, now, reason)
            return
        self._request(attempt, better, attempt.goal_id)

    def handle_reply(self, attempt: Attempt, allowed: tuple[str, ...], reply: Reply) -> None:
        """Process the reply to the requested goal."""
        goal, attempt.pending = attempt.pending, None
        assert goal is not None
        if isinstance(reply, AcceptedGoal):
            self._adopt(attempt, goal, reply)
            return
        now = self._clock.now
        self._publisher.publish_refusal(attempt, now, reply)
        code = reply.code if isinstance(reply, Refusal) else "unavailable"
        if goal.revises is None:
            if code not in GENERAL_REFUSALS:
                self._request_next(attempt, allowed)
        elif code in REPLACED_REFUSALS:
            self._publisher.end_without_hit(attempt, now, f"the swing was replaced: {reply}")
        elif code not in GENERAL_REFUSALS and (touch := next(attempt.candidates, None)) is not None:
            attempt.decision_time = now
            self._request(attempt, touch, goal.revises)

    def _adopt(self, attempt: Attempt, goal: PendingGoal, reply: AcceptedGoal) -> None:
        """Adopt an accepted hit or correction."""
        attempt.goal_id, attempt.choice, attempt.stage = reply.goal_id, goal.choice, "swinging"
        attempt.rest_time = reply.rest_time
        attempt.reason = attempt.reason_kind = ""
        attempt.revisions += goal.revises is not None
        self._leads[goal.revises is not None].note(reply.start_time - attempt.decision_time)
        self._publisher.publish(attempt, "planned" if goal.revises is None else "revised", self._clock.now)
        if goal.revises is not None:
            attempt.choice = self._hit_planner.with_simulated_contact(goal.choice)

    def _request_next(self, attempt: Attempt, allowed: tuple[str, ...]) -> None:
        """Request the next found hit for which there is still time; without one, `choose` searches again."""
        choice = next((c for c in attempt.candidates if c.goal_time > self._clock.now + MIN_TIME_S), None)
        if choice is not None:
            attempt.primitive = self._primitives.nearest(choice.goal_time - self._clock.now, allowed)
            self._request(attempt, choice, None)

    def _request(self, attempt: Attempt, choice: Choice, revises: str | None) -> None:
        attempt.pending = PendingGoal(next(self._goal_ids), choice, revises)
        follow_through = self._hit_planner.follow_through
        self._send_goal(goal_message(attempt.pending, attempt.primitive, follow_through, self._method))
