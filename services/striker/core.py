"""The striker without a bus: decisions about each ball."""

import itertools
import logging
import uuid
from collections.abc import Sequence

from protocol import messages as m
from robot.description import RobotConfig
from services.striker.attempt import Attempt
from services.striker.ball_tracker import LOST_S, BallTracker
from services.striker.clock import Clock
from services.striker.hit_planner import MIN_SIGHTS, HitPlanner
from services.striker.link import Reply, StrikerLink
from services.striker.messages import Method
from services.striker.orders import Order, order_of
from services.striker.primitives import StrikePrimitives
from services.striker.publications import DecisionPublisher
from services.striker.ready_pose import ReadyPoseReturn
from services.striker.swing import Swing


class Striker:
    """Strikes the balls that it sees while it has an order. Times are the robot's.

    The methods `handle_…` process events; `decide` then takes the next action.
    """

    def __init__(
        self,
        config: RobotConfig,
        hit_planner: HitPlanner,
        link: StrikerLink,
        library: Sequence[tuple[str, float]],
        log: logging.Logger,
        method: Method = "qp",
    ) -> None:
        """`library`: name and duration (s) of this arm's primitives. `method`: of the goals."""
        self._hit_planner = hit_planner
        self._link = link
        self._log = log
        self._goal_ids = (f"strike-{uuid.uuid4().hex[:6]}-{number}" for number in itertools.count(1))
        self._balls = itertools.count(1)
        self._clock = Clock(config.rate_hz)
        self._tracker = BallTracker(hit_planner.estimator, log)
        self._publisher = DecisionPublisher(link.publish, hit_planner.estimator, log)
        self._primitives = StrikePrimitives(library)
        self._ready_pose = ReadyPoseReturn(config, self._primitives, link.send_goal, log)
        self._swing = Swing(
            hit_planner, self._clock, self._primitives, self._publisher, link.send_goal, self._goal_ids, method
        )
        self._order: Order | None = None
        self._balls_left: int | None = None
        self._attempt: Attempt | None = None
        self._fault: str | None = None

    def start(self, request: m.StrikeRequest) -> m.Striking:
        """Start to strike as requested; this replaces an earlier order.

        Raises:
            Refusal: `bad_message`, naming the field; `unknown_primitive`.
        """
        order = order_of(request)
        self._primitives.check(order.primitives)
        if self._order is None:
            self._ready_pose.away = True  # so that it waits for the first ball in the ready pose
        self._order, self._balls_left = order, request.count
        self._log.info("strikes balls to %s", order.target.tolist())
        return m.Striking(active=True)

    def stop(self) -> m.Striking:
        """Strike no further ball; the present motion is played to its end."""
        self._order, self._attempt = None, None
        return m.Striking(active=False)

    def handle_ball(self, ball: m.BallState) -> None:
        """Process a sight of the ball."""
        self._read_command()
        position = self._tracker.checked_position(ball, self._clock.now)
        if position is None:
            return
        attempt = self._attempt
        if attempt and attempt.stage in ("swinging", "struck") and attempt.choice and ball.time > attempt.choice.time:
            attempt.sights.append((ball.time, position))
            return
        ended = self._tracker.update(ball, position)
        if ended and attempt and attempt.stage in ("seen", "swinging"):
            self._publisher.end_without_hit(attempt, self._clock.now, ended)

    def handle_contact(self, contact: m.Contact) -> None:
        """Process a contact, which may be the hit."""
        if self._attempt is not None:
            self._hit_planner.note_contact(self._attempt, contact)

    def handle_result(self, result: m.Result) -> None:
        """Process the result of a motion."""
        attempt = self._attempt
        if attempt and result.goal_id == attempt.goal_id and result.outcome == "aborted":
            self._publisher.end_without_hit(attempt, self._clock.now, f"the swing was aborted: {result.reason}")

    def handle_status(self, status: m.Status) -> None:
        """Process the controller's status: whether it is in fault."""
        self._fault = status.fault

    def handle_reply(self, goal_id: str, reply: Reply) -> None:
        """Process the reply to a goal; replies for earlier balls are ignored, and their motions end at rest."""
        attempt = self._attempt
        if self._ready_pose.handle_reply(goal_id, reply) or attempt is None:
            return
        if attempt.pending is not None and attempt.pending.goal_id == goal_id:
            self._ready_pose.away = True
            self._swing.handle_reply(attempt, self._order.primitives if self._order else (), reply)

    def decide(self) -> None:
        """Take the next action, if any."""
        self._read_command()
        if self._order is not None:
            if self._attempt is None or self._attempt.stage == "over":
                self._begin_attempt()
            self._return_to_ready_pose(self._order)
        attempt = self._attempt
        if attempt is None:
            return
        if attempt.stage == "swinging" and attempt.choice and self._clock.now > attempt.choice.time:
            attempt.stage = "struck"
        if attempt.stage == "struck":
            self._evaluate(attempt)
        elif attempt.stage != "over" and self._order is not None:
            self._plan_hit(attempt, self._order)

    def abandon_ball(self, reason: str) -> None:
        """Abandon the ball; the present motion is played to its end."""
        if self._attempt and self._attempt.stage != "over":
            self._publisher.end_without_hit(self._attempt, self._clock.now, reason)
        self._tracker.reset()

    def _begin_attempt(self) -> None:
        """Begin an attempt for a ball that is known well enough and approaches the arm."""
        ball = self._tracker.estimate(self._clock.now)
        if self._balls_left == 0 or ball is None or ball.sights < MIN_SIGHTS:
            return
        if self._hit_planner.is_approaching(ball):
            self._attempt = Attempt(next(self._balls), rest_time=self._attempt.rest_time if self._attempt else 0.0)
            self._publisher.publish(self._attempt, "seen", self._clock.now)

    def _return_to_ready_pose(self, order: Order) -> None:
        """Send the arm to the ready pose, once the motion of the last ball is over."""
        attempt, now = self._attempt, self._clock.now
        is_free = attempt is None or (attempt.stage in ("struck", "over") and now > attempt.rest_time)
        if is_free and not self._fault:
            self._ready_pose.request(now, self._goal_ids, order.primitives)

    def _plan_hit(self, attempt: Attempt, order: Order) -> None:
        """Choose a hit of an approaching ball, or correct it."""
        ball, now = self._tracker.estimate(self._clock.now), self._clock.now
        if attempt.stage == "swinging":
            if ball is not None:
                self._swing.correct(attempt, order, ball)
        elif ball is None:
            self._publisher.end_without_hit(attempt, now, f"the ball was not seen for {LOST_S} s")
        elif attempt.pending is None and not self._hit_planner.is_approaching(ball):
            self._publisher.end_without_hit(attempt, now, attempt.reason or "it went by before a hit was found")
        else:
            self._swing.choose(attempt, order, ball)

    def _evaluate(self, attempt: Attempt) -> None:
        """Publish whether the ball was hit and where it lands, and learn from it, once there are enough sights."""
        now = self._clock.now
        if not attempt.has_flown(now):
            return
        attempt.stage = "over"
        if self._balls_left is not None:
            self._balls_left = max(0, self._balls_left - 1)
        outcome = self._hit_planner.evaluate(attempt)
        if outcome is None:
            reason = "the ball went by the racket" if attempt.sights else "the ball was not seen again"
            self._publisher.end_without_hit(attempt, now, reason)
        else:
            self._publisher.publish(attempt, "hit", now, outcome=outcome)
            if outcome.landing is not None:
                self._publisher.publish(attempt, "landed", now, outcome=outcome)
        self._tracker.reset()
        if self._balls_left == 0:
            self._order = None

    def _read_command(self) -> None:
        """Process the controller's newest command; a new run discards the state of the last one."""
        command = self._link.newest_command()
        if command is not None and self._clock.update(command):
            self._tracker.reset(new_run=True)
            self._ready_pose.begin_run()
            self._attempt = None
