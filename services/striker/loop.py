"""The striker's loop: receive, decide, publish."""

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import zenoh

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus, PendingQuery
from protocol.bus.queues import Inbox
from protocol.codec import decode
from protocol.errors import NoAnswer, Refusal
from services.common.logs import ThrottledLog
from services.common.realtime import Urgency, receivers
from services.common.refusing import OWN_ERROR, refusing
from services.common.stray_puts import StrayPuts
from services.striker.core import Striker
from services.striker.outside import Taken

GOAL_TIMEOUT_S = 1.0
"""Timeout of a goal's reply, s; after it the arm ends its present motion."""
WAIT_S = 0.01
LISTENED = (topics.BALL, topics.CONTACT, topics.ENDED, topics.STATUS)
LENGTH = 256
"""Capacity of the inbox: more messages than arrive during the longest choice of a hit."""


@dataclass(frozen=True, slots=True)
class Published:
    """A body that was published on `topic`."""

    topic: topics.Publication[Any]
    body: bytes


@dataclass(frozen=True, slots=True)
class Answered:
    """The reply to a goal; `read` returns the motion that is played, or raises Refusal or NoAnswer."""

    goal_id: str
    read: Callable[[], Taken]


class BusLink:
    """The striker's goals and publications over the bus. Implements `Outside`."""

    def __init__(self, bus: Bus, inbox: Inbox[Any]) -> None:
        self._bus = bus
        self._inbox = inbox
        self._commands = bus.collect(topics.COMMAND, 1)
        self._said = bus.publisher(topics.STRIKES)

    def ask(self, goal: m.Goal) -> None:
        """Send a goal; its reply arrives in the inbox."""
        answered: list[bool] = []
        name = goal.goal_id or ""

        def receive(reply: zenoh.Reply | None) -> None:
            if reply is not None or not answered:
                answered.append(True)
                self._inbox.offer(Answered(name, partial(self._read, reply)))

        self._bus.send_to(topics.GOAL, goal, receive, GOAL_TIMEOUT_S)

    def _read(self, reply: zenoh.Reply | None) -> Taken:
        answer = self._bus.read(topics.GOAL, reply)
        return Taken(answer.goal_id, answer.start_time, answer.start_time + answer.total_duration)

    def command(self) -> m.Command | None:
        """Return the newest command, None if none has arrived since the last call."""
        taken = self._commands.take()
        if taken is None:
            return None
        try:
            return decode(taken[0], m.Command)
        except Refusal:
            return None

    def say(self, strike: m.Strike) -> None:
        """Publish a decision."""
        self._said.put(strike)


class Loop:
    """Passes messages to the striker in order of arrival."""

    def __init__(self, bus: Bus, inbox: Inbox[Any], striker: Striker, log: logging.Logger) -> None:
        self._bus = bus
        self._inbox = inbox
        self._striker = striker
        self._malformed = ThrottledLog(log)
        self._log = log

    def serve(self, stopping: threading.Event) -> None:
        """Serve requests and strike until `stopping` is set; the present motion then ends by itself, at rest."""
        with receivers():
            stray_puts = StrayPuts(self._bus, self._log)
            for topic in LISTENED:
                self._bus.listen(topic, lambda body, topic=topic: self._inbox.offer(Published(topic, body)))
            self._bus.serve(topics.STRIKE, self._inbox)
            self._bus.serve(topics.STRIKE_STOP, self._inbox)
            self._bus.announce("striker")
        urgency = Urgency()
        while not stopping.is_set():
            urgency.update(keeps_up=self._inbox.is_empty)
            item = self._inbox.take(WAIT_S)
            while item is not None:
                self.receive(item)
                item = self._inbox.take()
            self._decide()
            stray_puts.warn()

    def _decide(self) -> None:
        """Decide; after an unexpected error only this ball is abandoned, and the present motion ends at rest."""
        try:
            self._striker.decide()
        except Exception:
            self._log.exception("the striker met an error of its own; it gives up this ball")
            self._striker.give_up(OWN_ERROR.format(service="striker"))

    def receive(self, item: Published | Answered | PendingQuery) -> None:
        """Pass one item on."""
        match item:
            case Published():
                self._read(item)
            case Answered():
                self._answer(item)
            case PendingQuery():
                self._serve(item)

    def _read(self, published: Published) -> None:
        try:
            message = decode(published.body, published.topic.message)
        except Refusal as refusal:
            self._malformed.warn(f"a malformed message on {published.topic.key} was left out: {refusal}", refusal.code)
            return
        match message:
            case m.BallState():
                self._striker.see(message)
            case m.Contact():
                self._striker.touch(message)
            case m.Result():
                self._striker.ended(message)
            case m.Status():
                self._striker.note(message)

    def _answer(self, answered: Answered) -> None:
        try:
            reply = answered.read()
        except (Refusal, NoAnswer) as error:  # a variable that keeps it would make a cycle with its traceback
            self._striker.answered(answered.goal_id, error)
        else:
            self._striker.answered(answered.goal_id, reply)

    def _serve(self, asking: PendingQuery) -> None:
        """Reply to a request, or refuse it."""
        with refusing(asking, "striker", self._log):
            match request := asking.decode():
                case m.StrikeRequest():
                    asking.reply(self._striker.order(request))
                case _:
                    asking.reply(self._striker.stop())
