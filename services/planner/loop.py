"""The planner's loop: answers one request at a time; long work runs elsewhere."""

import gc
import logging
import threading
import time
import uuid
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, cast

import msgspec

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.pending_query import PendingQuery
from protocol.bus.queues import Inbox
from protocol.codec import decode
from protocol.errors import NoAnswer, Refusal
from robot.description import RobotConfig
from services.common.realtime import Urgency, prioritise_new_threads
from services.common.refusing import refusing
from services.common.stray_puts import StrayPuts
from services.planner.core import Planner
from services.planner.lead_time import LeadTime
from services.planner.learner import Head, Learner
from services.planner.library import Library
from services.planner.solving import Steps
from services.planner.watch import ControllerWatch
from services.planner.worker import Task
from services.planner.worker_link import Worker
from services.planner.worker_thread import LoopCall, WorkerThread

UNREAD_LEARN = replace(topics.LEARN, request=msgspec.Raw)
"""`learn` with its body as bytes, which the worker decodes."""


@dataclass(slots=True, eq=False)
class PendingGoal:
    """A goal without a reply yet, its steps, and the task to plan before the next step."""

    query: PendingQuery
    goal: m.Goal
    goal_id: str
    steps: Steps[None]
    task: Task | None = None


class Loop:
    """Answers the planner's requests.

    Work that takes longer than 50 ms runs in separate processes, while the loop serves other requests: learning, and
    planning of goals with the method "gaussian". repeated: by id of the pending goals, requests with the same id.
    """

    def __init__(
        self, bus: Bus, planner: Planner, library: Library, config: RobotConfig, lead: LeadTime, log: logging.Logger
    ) -> None:
        self._bus = bus
        self._planner = planner
        self._library = library
        self._lead = lead
        self._log = log
        self._joints = config.joint_names
        self.inbox: Inbox[Any] = Inbox()  # requests, and calls of the worker threads
        worker = Worker("learn", config.limits, config.joint_names, log)
        self._learner = Learner(library, worker, planner.keep, self.inbox, log)
        self.plan_worker = Worker("plan", config.limits, config.joint_names, log)
        self._planning = WorkerThread(self.plan_worker, self.inbox, log)
        self.repeated: dict[str, list[PendingQuery]] = {}

    def serve(self, stopping: threading.Event) -> None:
        """Answer requests one at a time until `stopping` is set."""
        arm_appeared = threading.Event()
        with prioritise_new_threads():
            watch = ControllerWatch(self._bus, self._log, self._planner.receive_status)
            stray_puts = StrayPuts(self._bus, self._log)
            for topic in topics.QUERIES:
                if topic.owner == "planner":
                    self._bus.serve(UNREAD_LEARN if topic is topics.LEARN else topic, self.inbox)
            self._bus.announce("planner")
            self._bus.watch_alive(
                topics.alive_key("sim"), lambda _, alive: arm_appeared.set() if alive else arm_appeared.clear()
            )
        urgency = Urgency()
        while not stopping.is_set():
            urgency.update(keeps_up=self.inbox.is_empty)
            item = self.inbox.take(0.1)
            watch.update(time.monotonic())
            stray_puts.warn()
            if arm_appeared.is_set():
                arm_appeared.clear()
                if (stepped := is_stepped(self._bus)) is None:
                    arm_appeared.set()  # ask again
                else:
                    self._lead.stepped = stepped
            self.do(item)
            # Collect garbage between plans only: the young generations after each, all when idle.
            gc.collect(1 if item is not None else 2)
        self.close()

    def do(self, item: PendingQuery | LoopCall | None) -> None:
        """Handle an item of the inbox, if there is one."""
        if isinstance(item, LoopCall):
            item.run()
        elif item is not None:
            self.answer(item)

    def answer(self, query: PendingQuery) -> None:
        """Reply to a request, or refuse it."""
        with self._refusing(query):
            match request := query.decode():
                case m.Goal() as goal:
                    self._begin(query, goal)
                case msgspec.Raw():
                    self._learn(query, memoryview(request))  # 16 MiB are not copied again
                case m.Forget():
                    query.reply(self._planner.forget(request))
                case _:
                    query.reply(self._planner.primitives(request))

    def close(self) -> None:
        """End the worker processes."""
        self._learner.close()
        self._planning.close()

    def _refusing(
        self, query: PendingQuery, goal: m.Goal | None = None, goal_id: str | None = None
    ) -> AbstractContextManager[None]:
        """Reply with the refusal that the block raises; for a goal, also publish it under the goal's id."""

        def publish(refusal: Refusal) -> None:
            if query.topic is topics.GOAL:
                self._planner.publish_refused(goal, goal_id, refusal, query.arrival_ns)

        joints = self._joints if query.topic is topics.GOAL else ()  # in `learn`, a first index is a sample
        return refusing(query, "planner", self._log, goal_id, publish, joints)

    def _begin(self, query: PendingQuery, goal: m.Goal) -> None:
        """Answer a goal at once, or start planning it in the worker process."""
        if goal.goal_id in self.repeated:  # pending: it gets the same reply later
            self.repeated[goal.goal_id].append(query)
            return
        goal_id = topics.legible(goal.goal_id or uuid.uuid4().hex)  # the id itself may be refused
        pending = PendingGoal(query, goal, goal_id, self._planner.goal(goal, goal_id, query.arrival_ns, query.reply))
        if self._go_on(pending, lambda: next(pending.steps)):
            with self._refusing(query, goal, goal_id):
                self._planning.submit(lambda: self._plan_elsewhere(pending))
                self.repeated[goal_id] = []

    def _go_on(self, pending: PendingGoal, step: Callable[[], Task | None]) -> bool:
        """Run a goal's next step; return whether another follows, after its `task` is planned."""
        with self._refusing(pending.query, pending.goal, pending.goal_id):
            try:
                pending.task = step()
            except StopIteration:
                pass
            else:
                return True
        for repeated in self.repeated.pop(pending.goal_id, []):
            self.answer(repeated)
        return False

    def _plan_elsewhere(self, pending: PendingGoal) -> None:
        """Plan a goal in the worker process; called in the worker's thread."""
        self.plan_worker.start()  # before the start of the motion is chosen
        step: Callable[[], Task | None] = partial(next, pending.steps)
        while self._planning.in_loop(partial(self._go_on, pending, step)):
            assert pending.task is not None
            try:
                step = partial(pending.steps.send, self.plan_worker.plan(pending.task))
            except Exception as error:
                step = partial(pending.steps.throw, error)

    def _learn(self, query: PendingQuery, body: memoryview) -> None:
        """Refuse faults outside the demonstration at once; pass the rest to the learner."""
        head = decode(cast(bytes, body), Head, topics.LEARN.max_bytes)
        if head.name is not None:
            self._library.check_name(head.name, head.replace)
        self._learner.submit(query, head, body)


def is_stepped(bus: Bus) -> bool | None:
    """Return whether the arm's clock is stepped, or None if the arm does not reply."""
    try:
        return bus.ask(topics.DESCRIPTION, m.Empty(), timeout=1.0).clock == "stepped"
    except (NoAnswer, Refusal):
        return None
