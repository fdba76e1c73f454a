"""The planner's loop: one request at a time, none for long."""

import gc
import logging
import threading
import time
import uuid
from dataclasses import replace
from typing import Any, cast

import msgspec

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus, PendingQuery
from protocol.bus.queues import Inbox
from protocol.codec import decode
from protocol.errors import NoAnswer, Refusal
from robot.description import RobotConfig
from services.common.puts import PutWatch
from services.planner.core import Planner
from services.planner.lead import Lead
from services.planner.learner import Errand, Head, Learner
from services.planner.library import Library
from services.planner.watch import ControllerWatch
from services.planner.worker import OWN_ERROR
from services.planner.worker_link import Worker

UNREAD_LEARN = replace(topics.LEARN, request=msgspec.Raw)
"""`learn` with its body left as bytes: the worker reads it."""


class Loop:
    """Answers the planner's requests; what is learned is handed to a `Learner`."""

    def __init__(
        self, bus: Bus, planner: Planner, library: Library, config: RobotConfig, lead: Lead, log: logging.Logger
    ) -> None:
        self._bus = bus
        self._planner = planner
        self._library = library
        self._lead = lead
        self._log = log
        self.inbox: Inbox[Any] = Inbox()  # of requests, and of the learner's errands
        worker = Worker(config.limits, config.joint_names, log)
        self._learner = Learner(library, worker, planner.keep, self.inbox, log)

    def serve(self, stopping: threading.Event) -> None:
        """Answer requests one at a time until `stopping` is set."""
        arm_appeared = threading.Event()
        watch, puts = ControllerWatch(self._bus, self._log), PutWatch(self._bus, self._log)
        for query in topics.QUERIES:
            if query.owner == "planner":
                self._bus.serve(UNREAD_LEARN if query is topics.LEARN else query, self.inbox)
        self._bus.announce("planner")
        self._bus.watch_alive(topics.alive_key("sim"), lambda _, alive: arm_appeared.set() if alive else None)
        while not stopping.is_set():
            item = self.inbox.take(0.1)
            watch.look(time.monotonic())
            puts.look()
            if arm_appeared.is_set():
                arm_appeared.clear()
                self._lead.stepped = is_stepped(self._bus)
            self.do(item)
            # Never while one plans: after each what is new, when there is time everything.
            gc.collect(1 if item is not None else 2)
        self.close()

    def do(self, item: PendingQuery | Errand | None) -> None:
        """Do what came, if anything did."""
        if isinstance(item, Errand):
            item.run()
        elif item is not None:
            self.answer(item)

    def answer(self, asking: PendingQuery) -> None:
        """Reply to a request, or refuse it and say why in the log, and of a goal on the bus, under the goal's id.

        An error that nobody foresaw is refused as well: it is one request's, and the planner goes on for the others.
        """
        goal, goal_id = None, None
        try:
            match request := asking.decode():
                case m.Goal() as goal:
                    # Cut, for an id may be refused for its length.
                    goal_id = (goal.goal_id or uuid.uuid4().hex)[: topics.MAX_ID]
                    self._planner.goal(goal, goal_id, asking.arrival_ns, asking.reply)
                case msgspec.Raw():
                    self._learn(asking, memoryview(request))  # 16 MiB are not copied again
                case m.Forget():
                    asking.reply(self._planner.forget(request))
                case _:
                    asking.reply(self._planner.primitives(request))
            return
        except Refusal as reason:
            refusal = reason
        except Exception:
            self._log.exception("%s met an error of the planner", asking.topic.key, extra={"goal_id": goal_id})
            detail = {"service": "planner"} | ({"goal_id": goal_id} if goal_id else {})
            refusal = Refusal("unavailable", OWN_ERROR, **detail)
        asking.refuse(refusal)
        fields = {"goal_id": goal_id, "code": refusal.code}
        self._log.info("%s refused as %s: %s", asking.topic.key, refusal.code, refusal, extra=fields)
        if asking.topic is topics.GOAL:
            self._planner.tell_refused(goal, goal_id, refusal, asking.arrival_ns)

    def close(self) -> None:
        """End the worker."""
        self._learner.close()

    def _learn(self, asking: PendingQuery, body: memoryview) -> None:
        """Refuse at once what needs no look at the demonstration; the rest is the learner's."""
        head = decode(cast(bytes, body), Head, topics.LEARN.max_bytes)
        if head.name is not None:
            self._library.check_name(head.name, head.replace)
        self._learner.submit(asking, head, body)


def is_stepped(bus: Bus) -> bool:
    """Return whether the arm's clock advances on request only."""
    try:
        return bus.ask(topics.DESCRIPTION, m.Empty(), timeout=1.0).clock == "stepped"
    except (NoAnswer, Refusal):
        return False
