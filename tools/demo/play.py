"""Play one strike on running services and collect its result."""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass

from client import Arm, GoalFields, topics
from protocol import messages as m
from tools.demo.strikes import PRIMITIVE, PUSH_FOR, PUSH_FROM, Strike, largest, noise_request

SETTLE_S = 0.4
"""Rest before a strike, s of wall time."""
FLIGHT_S = 0.8
"""Recorded flight of the ball after a strike, s of wall time."""
CONTACTS = 64
"""Capacity of the stream of contacts: more than a strike has."""


@dataclass(frozen=True, slots=True)
class StrikeOutcome:
    """The outcome of a strike.

    Attributes:
        strike: The strike.
        reply: The planner's reply.
        result: The controller's result.
        ball_speed: Speed of the ball after the touch, m/s; 0 if the racket missed it.
        robot_s: Duration of the run in robot time, s.
        wall_s: Duration of the run in wall time, s.
    """

    strike: Strike
    reply: m.GoalReply
    result: m.Result
    ball_speed: float
    robot_s: float
    wall_s: float

    def failures(self) -> list[str]:
        """Return a sentence for each bound that failed."""
        result, strike = self.result, self.strike
        if result.hit is None or result.hit.truth_error is None:
            return [f"the goal was {result.outcome} before the hit: {result.reason}"]
        position, velocity = self.true_errors()
        found = []
        if result.outcome != "succeeded":
            found.append(f"the goal was {result.outcome}: {result.reason}")
        if not self.reply.report.certified:
            found.append("the plan has no certificate for its limits")
        if position > strike.position_bound:
            found.append(f"the hit is {position:.2g} rad off, more than {strike.position_bound:.2g}")
        if velocity > strike.velocity_bound:
            found.append(f"the hit is {velocity:.2g} rad/s off, more than {strike.velocity_bound:.2g}")
        if not self.ball_speed:
            found.append("the racket missed the ball")
        return found

    def true_errors(self) -> tuple[float, float]:
        """Return the largest position error, rad, and velocity error, rad/s, of the true arm at the hit."""
        hit = self.result.hit
        assert hit is not None
        assert hit.truth_error is not None
        return largest(hit.truth_error.positions), largest(hit.truth_error.velocities)


class Player:
    """Plays strikes on running services."""

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        self._contacts = arm.stream(topics.CONTACT, CONTACTS)

    def play(self, strike: Strike, seed: int, say: Callable[[str], object]) -> StrikeOutcome:
        """Place the arm and the ball, strike, and wait until the arm is at rest.

        `say` is called with a short description of each step.

        Raises:
            Refusal: the goal or a disturbance was refused.
            NoAnswer: a service does not reply.
        """
        arm = self._arm
        say("placing arm and ball")
        arm.reset_sim(positions=strike.start, seed=seed)
        began = time.monotonic()
        if strike.noise:
            arm.ask(topics.SIM_DISTURB, noise_request(strike))
        time.sleep(SETTLE_S)
        self._ball_speed()  # drops the contacts of the strike before
        say("planning")
        fields: GoalFields = {**strike.fields, "goal_id": strike.title.replace(" ", "-").replace(",", "")}
        motion = arm.goal(PRIMITIVE, **fields)
        if strike.push is not None:
            begin = motion.start_time + PUSH_FROM
            arm.disturb("acceleration", values=strike.push, start_time=begin, duration=PUSH_FOR)
        say(f"striking in {motion.reply.duration:.2f} s")
        result = motion.wait()
        say("watching the ball")
        time.sleep(FLIGHT_S)
        robot_s, wall_s = arm.state().time, time.monotonic() - began
        return StrikeOutcome(strike, motion.reply, result, self._ball_speed(), robot_s, wall_s)

    def _ball_speed(self) -> float:
        """Return the ball's speed after the touch, m/s; 0 if the racket missed it."""
        speed = 0.0
        with contextlib.suppress(TimeoutError):
            while True:
                contact = self._contacts.take(timeout=0)
                if "racket" in contact.bodies and contact.ball_velocity is not None:
                    speed = sum(component**2 for component in contact.ball_velocity) ** 0.5
        return speed
