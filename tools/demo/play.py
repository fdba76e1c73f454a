"""Play one strike on running services and collect its result."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import msgspec

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from tools.demo.strikes import PUSH_FOR, PUSH_FROM, Strike, largest, noise_request

SETTLE_S = 0.4
"""Rest before a strike, s of wall time."""
FLIGHT_S = 0.8
"""Recorded flight of the ball after a strike, s of wall time."""
POLL_S = 0.02
CONTACTS = 64
"""Capacity of the queue of contacts: more than a strike has."""


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

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._contacts = bus.collect(topics.CONTACT, CONTACTS)

    def play(self, strike: Strike, seed: int, say: Callable[[str], object]) -> StrikeOutcome:
        """Place the arm and the ball, strike, and wait until the arm is at rest.

        `say` is called with a short description of each step.

        Raises:
            Refusal: the goal or a disturbance was refused.
            NoAnswer: a service does not reply.
        """
        say("placing arm and ball")
        start = None if strike.start is None else list(strike.start)
        self._bus.ask(topics.SIM_RESET, m.Reset(positions=start, seed=seed))
        began = time.monotonic()
        if strike.noise:
            self._bus.ask(topics.SIM_DISTURB, noise_request(strike))
        time.sleep(SETTLE_S)
        self._ball_speed()  # drops the contacts of the strike before
        say("planning")
        name = strike.title.replace(" ", "-").replace(",", "")
        reply = self._bus.ask(topics.GOAL, msgspec.structs.replace(strike.goal, goal_id=name))
        if strike.push is not None:
            begin = reply.start_time + PUSH_FROM
            push = m.Disturb(kind="acceleration", values=list(strike.push), start_time=begin, duration=PUSH_FOR)
            self._bus.ask(topics.SIM_DISTURB, push)
        say(f"striking in {reply.duration:.2f} s")
        result = self._wait(reply)
        say("watching the ball")
        time.sleep(FLIGHT_S)
        robot_s, wall_s = self._bus.ask(topics.STATE_QUERY, m.Empty()).time, time.monotonic() - began
        return StrikeOutcome(strike, reply, result, self._ball_speed(), robot_s, wall_s)

    def _wait(self, reply: m.GoalReply) -> m.Result:
        """Wait until the goal has ended, and return its result."""
        time.sleep(reply.total_duration)
        while True:
            result = self._bus.ask(topics.RESULT, m.ResultRequest(goal_id=reply.goal_id))
            if result.outcome != "running":
                return result
            time.sleep(POLL_S)

    def _ball_speed(self) -> float:
        """Return the ball's speed after the touch, m/s; 0 if the racket missed it."""
        speed = 0.0
        for body, _ in iter(self._contacts.take, None):
            contact = decode(body, m.Contact)
            if "racket" in contact.bodies and contact.ball_velocity is not None:
                speed = sum(component**2 for component in contact.ball_velocity) ** 0.5
        return speed
