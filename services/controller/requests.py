"""Requests to the controller, in order of urgency."""

import time
from collections.abc import Callable
from typing import Any

from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.pending_query import PendingQuery
from protocol.bus.queues import Inbox
from protocol.errors import Refusal
from services.controller.checker import TrajectoryChecker
from services.controller.core import Controller
from services.controller.leases import ClientLeases


class Requests:
    """Answers one request at a time: stops before motions, motions before requests that only read."""

    def __init__(
        self,
        core: Controller,
        leases: ClientLeases,
        checker: TrajectoryChecker,
        catch_up: Callable[[], object],
        wake: Callable[[], object],
    ) -> None:
        """Prepare; `catch_up` processes the newest states, and `wake` is called once a request can be answered."""
        self._core = core
        self._leases = leases
        self._checker = checker
        self._catch_up = catch_up
        self._commands: Inbox[PendingQuery] = Inbox(wake=wake)
        self._questions: Inbox[PendingQuery] = Inbox(wake=wake)
        self._handlers: dict[str, Callable[[Any], Any]] = {
            topics.REFERENCE.key: core.reference,
            topics.CANCEL.key: core.cancel,
            topics.RESET.key: lambda _: core.reset(),
            topics.RESULT.key: lambda request: core.ledger.result(request.goal_id),
            topics.STATUS_QUERY.key: lambda _: core.status(),
        }

    def open(self, bus: Bus) -> None:
        """Declare the controller's requests on the bus."""
        for topic in topics.QUERIES:
            if topic.owner == "controller" and topic.key in self._handlers:
                bus.serve(topic, self._questions if topic.reads else self._commands)
        bus.serve(topics.EXECUTE, self._checker.requests)

    def answer_one(self) -> bool:
        """Answer the most urgent request; return whether there was one."""
        if (query := self._commands.take()) is not None:
            self._handle(query)
        elif (checked := self._checker.take()) is not None:
            query, trajectory = checked
            self._catch_up()
            _reply(query, lambda: self._core.execute(trajectory, self._leases.clients, time.time_ns()))
        elif (query := self._questions.take()) is not None:
            self._handle(query)
        else:
            return False
        return True

    def _handle(self, query: PendingQuery) -> None:
        _reply(query, lambda: self._handlers[query.topic.key](query.decode()))


def _reply(query: PendingQuery, act: Callable[[], Any]) -> None:
    try:
        query.reply(act())
    except Refusal as refusal:
        query.refuse(refusal)
