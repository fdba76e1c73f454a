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
from protocol.bus.bus import Bus, PendingQuery
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
class Going:
    """A goal without a reply yet, its steps, and the task to plan before the next step."""

    asking: PendingQuery
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
            for query in topics.QUERIES:
                if query.owner == "planner":
                    self._bus.serve(UNREAD_LEARN if query is topics.LEARN else query, self.inbox)
            self._bus.announce("planner")
            self._bus.watch_alive(
                topics.alive_key("sim"), lambda _, alive: arm_appeared.set() if alive else arm_appeared.clear()
            )
        urgency = Urgency()
        while not stopping.is_set():
            urgency.update(keeps_up=self.inbox.is_empty)
            item = self.inbox.take(0.1)
            watch.look(time.monotonic())
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

    def answer(self, asking: PendingQuery) -> None:
        """Reply to a request, or refuse it."""
        with self._refusing(asking):
            match request := asking.decode():
                case m.Goal() as goal:
                    self._begin(asking, goal)
                case msgspec.Raw():
                    self._learn(asking, memoryview(request))  # 16 MiB are not copied again
                case m.Forget():
                    asking.reply(self._planner.forget(request))
                case _:
                    asking.reply(self._planner.primitives(request))

    def close(self) -> None:
        """End the worker processes."""
        self._learner.close()
        self._planning.close()

    def _refusing(
        self, asking: PendingQuery, goal: m.Goal | None = None, goal_id: str | None = None
    ) -> AbstractContextManager[None]:
        """Reply with the refusal that the block raises; for a goal, also publish it under the goal's id."""

        def publish(refusal: Refusal) -> None:
            if asking.topic is topics.GOAL:
                self._planner.publish_refused(goal, goal_id, refusal, asking.arrival_ns)

        joints = self._joints if asking.topic is topics.GOAL else ()  # in `learn`, a first index is a sample
        return refusing(asking, "planner", self._log, goal_id, publish, joints)

    def _begin(self, asking: PendingQuery, goal: m.Goal) -> None:
        """Answer a goal at once, or start planning it in the worker process."""
        if goal.goal_id in self.repeated:  # pending: it gets the same reply later
            self.repeated[goal.goal_id].append(asking)
            return
        goal_id = topics.legible(goal.goal_id or uuid.uuid4().hex)  # the id itself may be refused
        going = Going(asking, goal, goal_id, self._planner.goal(goal, goal_id, asking.arrival_ns, asking.reply))
        if self._go_on(going, lambda: next(going.steps)):
            with self._refusing(asking, goal, goal_id):
                self._planning.submit(lambda: self._plan_elsewhere(going))
                self.repeated[goal_id] = []

    def _go_on(self, going: Going, step: Callable[[], Task | None]) -> bool:
        """Run a goal's next step; return whether another follows, after its `task` is planned."""
        with self._refusing(going.asking, going.goal, going.goal_id):
            try:
                going.task = step()
            except StopIteration:
                pass
            else:
                return True
        for repeated in self.repeated.pop(going.goal_id, []):
            self.answer(repeated)
        return False

    def _plan_elsewhere(self, going: Going) -> None:
        """Plan a goal in the worker process; called in the worker's thread."""
        self.plan_worker.start()  # before the start of the motion is chosen
        step: Callable[[], Task | None] = partial(next, going.steps)
        while self._planning.in_loop(partial(self._go_on, going, step)):
            assert going.task is not None
            try:
                step = partial(going.steps.send, self.plan_worker.plan(going.task))
            except Exception as error:
                step = partial(going.steps.throw, error)

    def _learn(self, asking: PendingQuery, body: memoryview) -> None:
        """Refuse faults outside the demonstration at once; pass the rest to the learner."""
        head = decode(cast(bytes, body), Head, topics.LEARN.max_bytes)
        if head.name is not None:
            self._library.check_name(head.name, head.replace)
        self._learner.submit(asking, head, body)


def is_stepped(bus: Bus) -> bool | None:
    """Return whether the arm's clock is stepped, or None if the arm does not reply."""
    try:
        return bus.ask(topics.DESCRIPTION, m.Empty(), timeout=1.0).clock == "stepped"
    except (NoAnswer, Refusal):
        return None
