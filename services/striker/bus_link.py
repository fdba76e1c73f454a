"""The striker's goals, commands and publications over the bus."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import zenoh

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.queues import Inbox
from protocol.codec import decode
from protocol.errors import Refusal
from services.striker.link import AcceptedGoal

GOAL_TIMEOUT_S = 1.0
"""Timeout of a goal's reply, s; after it the arm ends its present motion."""


@dataclass(frozen=True, slots=True)
class GoalAnswer:
    """The reply to a goal; `read` returns the motion that is played, or raises Refusal or NoAnswer."""

    goal_id: str
    read: Callable[[], AcceptedGoal]


class BusLink:
    """The striker's environment over the bus; implements `StrikerLink`. Replies arrive in the inbox."""

    def __init__(self, bus: Bus, inbox: Inbox[Any]) -> None:
        self._bus = bus
        self._inbox = inbox
        self._commands = bus.collect(topics.COMMAND, 1)
        self._strikes = bus.publisher(topics.STRIKES)

    def send_goal(self, goal: m.Goal) -> None:
        """Send a goal; its reply arrives in the inbox."""
        answered: list[bool] = []
        goal_id = goal.goal_id or ""

        def receive(reply: zenoh.Reply | None) -> None:
            if reply is not None or not answered:
                answered.append(True)
                self._inbox.offer(GoalAnswer(goal_id, partial(self._read, reply)))

        self._bus.send_to(topics.GOAL, goal, receive, GOAL_TIMEOUT_S)

    def newest_command(self) -> m.Command | None:
        """Return the newest command, None if none has arrived since the last call."""
        taken = self._commands.take()
        if taken is None:
            return None
        try:
            return decode(taken[0], m.Command)
        except Refusal:
            return None

    def publish(self, strike: m.Strike) -> None:
        """Publish a decision."""
        self._strikes.put(strike)

    def _read(self, reply: zenoh.Reply | None) -> AcceptedGoal:
        answer = self._bus.read(topics.GOAL, reply)
        return AcceptedGoal(answer.goal_id, answer.start_time, answer.start_time + answer.total_duration)
