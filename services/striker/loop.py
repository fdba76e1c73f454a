"""The striker's loop: receive, decide, publish."""

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.pending_query import PendingQuery
from protocol.bus.queues import Inbox
from protocol.codec import decode
from protocol.errors import NoAnswer, Refusal
from services.common.logs import ThrottledLog
from services.common.realtime import Urgency, prioritise_new_threads
from services.common.refusing import OWN_ERROR, refusing
from services.common.stray_puts import StrayPuts
from services.striker.bus_link import GoalAnswer
from services.striker.core import Striker

WAIT_S = 0.01
"""Longest wait for a message between two decisions, s."""
LISTENED = (topics.BALL, topics.CONTACT, topics.ENDED, topics.STATUS)
LENGTH = 256
"""Capacity of the inbox: more messages than arrive during the longest choice of a hit."""


@dataclass(frozen=True, slots=True)
class Published:
    """A body that was published on `topic`."""

    topic: topics.Publication[Any]
    body: bytes


class Loop:
    """Passes messages to the striker in order of arrival."""

    def __init__(self, bus: Bus, inbox: Inbox[Any], striker: Striker, log: logging.Logger) -> None:
        self._bus = bus
        self._inbox = inbox
        self._striker = striker
        self._handlers: dict[str, Callable[[Any], Any]] = {
            topics.STRIKE.key: striker.start,
            topics.STRIKE_STOP.key: lambda _: striker.stop(),
        }
        self._malformed = ThrottledLog(log)
        self._log = log

    def serve(self, stopping: threading.Event) -> None:
        """Serve requests and strike until `stopping` is set; the present motion then ends by itself, at rest."""
        with prioritise_new_threads():
            stray_puts = StrayPuts(self._bus, self._log)
            for topic in LISTENED:
                self._bus.listen(topic, lambda body, topic=topic: self._inbox.offer(Published(topic, body)))
            for query in topics.QUERIES:
                if query.owner == "striker":
                    self._bus.serve(query, self._inbox)
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
            self._striker.abandon_ball(OWN_ERROR.format(service="striker"))

    def receive(self, item: Published | GoalAnswer | PendingQuery) -> None:
        """Pass one item on."""
        match item:
            case Published():
                self._read(item)
            case GoalAnswer():
                self._take_answer(item)
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
                self._striker.handle_ball(message)
            case m.Contact():
                self._striker.handle_contact(message)
            case m.Result():
                self._striker.handle_result(message)
            case m.Status():
                self._striker.handle_status(message)

    def _take_answer(self, answer: GoalAnswer) -> None:
        try:
            reply = answer.read()
        except (Refusal, NoAnswer) as error:  # a variable that keeps it would make a cycle with its traceback
            self._striker.handle_reply(answer.goal_id, error)
        else:
            self._striker.handle_reply(answer.goal_id, reply)

    def _serve(self, query: PendingQuery) -> None:
        """Reply to a request, or refuse it."""
        with refusing(query, "striker", self._log):
            query.reply(self._handlers[query.topic.key](query.decode()))
