"""Goals of the method "gaussian" are planned concurrently with the planner's loop, by a worker process.

Tests of what happens during planning suspend the worker, so that they do not depend on its speed.
"""

import logging
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from deploy.demonstrations.make_forehand import HIT, HIT_VELOCITIES
from motion.sampled import SampledPlan
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.queues import Inbox
from protocol.bus.sessions import open_session
from protocol.errors import Refusal
from robot.description import load_robot
from robot.shipped import DEMONSTRATIONS
from services.common.cli import free_endpoint
from services.planner.core import Planner
from services.planner.lead_time import LeadTime
from services.planner.learning import learn_from_csv
from services.planner.library import Arm, Library
from services.planner.loop import Loop
from services.planner.worker import Task
from tests.connections import unread
from tools.drill.harness.waiting import PATIENCE_S, eventually

LOG = logging.getLogger("planner")
ROBOT = load_robot()
ARM = Arm(ROBOT.name, ROBOT.joint_names)
HOME, STILL = ROBOT.home.tolist(), [0.0] * ROBOT.joint_count
STRIKE: dict[str, Any] = {"primitive": "forehand", "positions": list(HIT), "velocities": list(HIT_VELOCITIES)}


def strike(**fields: Any) -> m.Goal:
    """Return a goal for the forehand by the paper's formulation, with changed `fields`."""
    return m.Goal(**{**STRIKE, "method": "gaussian", **fields})


class Controller:
    """A controller at rest, with a constant clock, that accepts plans of its newest epoch."""

    def __init__(self, bus: Bus) -> None:
        self.executed: list[str] = []
        self.references = 0
        self.refuse: list[Refusal] = []
        self._inbox: Inbox[Any] = Inbox()
        bus.serve(topics.REFERENCE, self._inbox)
        bus.serve(topics.EXECUTE, self._inbox)
        self.stopping = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self.stopping.set()
        self._thread.join()

    def _serve(self) -> None:
        while not self.stopping.is_set():
            query = self._inbox.take(0.02)
            if query is None:
                continue
            try:
                query.reply(self._answer(query.decode()))
            except Refusal as refusal:
                query.refuse(refusal)

    def _answer(self, asked: m.Message) -> m.Message:
        epoch = len(self.executed)
        if isinstance(asked, m.ReferenceRequest):
            self.references += 1
            return m.Reference(
                time=asked.lead or 0.0, epoch=epoch, positions=HOME, velocities=STILL, accelerations=STILL
            )
        assert isinstance(asked, m.Trajectory)
        if self.refuse:
            raise self.refuse.pop()
        if asked.epoch < epoch:
            raise Refusal("superseded", "another plan came between", goal_id=asked.goal_id, cause="plan")
        self.executed.append(asked.goal_id)
        return m.Accepted(goal_id=asked.goal_id, start_time=asked.start_time)


class PlannerHarness:
    """A client, a controller, and the planner's loop between them."""

    def __init__(self, client: Bus, controller: Controller, loop: Loop) -> None:
        self.controller = controller
        self.loop = loop
        self._client = client

    def send(self, goal: m.Goal) -> Callable[[], m.GoalReply]:
        """Send a goal, and return a function that waits for its answer."""
        return self._client.send(topics.GOAL, goal, PATIENCE_S)

    def ask(self, goal: m.Goal) -> m.GoalReply:
        """Send a goal and wait for its answer."""
        return self.send(goal)()

    def refusal(self, answer: Callable[[], m.GoalReply]) -> Refusal:
        """Return the refusal that a goal must get."""
        with pytest.raises(Refusal) as caught:
            answer()
        return caught.value

    @property
    def pid(self) -> int:
        """The id of the worker process, 0 without one."""
        process = self.loop.plan_worker.process
        return process.pid if process else 0

    @contextmanager
    def planning(self, goal: m.Goal) -> Iterator[Callable[[], m.GoalReply]]:
        """Send a goal, suspend its planning until the block ends, and yield a function that waits for the answer."""
        os.kill(self.pid, signal.SIGSTOP)
        try:
            answer = self.send(goal)
            assert eventually(self._has_sent_the_task)
            yield answer
        finally:
            os.kill(self.pid, signal.SIGCONT)

    def _has_sent_the_task(self) -> bool:
        """Return whether the worker's socket has unread bytes."""
        connection = self.loop.plan_worker.connection
        assert connection
        return unread(connection.fileno()) > 0


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Directory of a library with the forehand."""
    folder = tmp_path_factory.mktemp("library")
    forehand = learn_from_csv(DEMONSTRATIONS / "forehand.csv", ROBOT.joint_names)
    assert forehand is not None
    Library(folder, ARM, LOG).put("forehand", forehand)
    return folder


@pytest.fixture(scope="module")
def started(shipped: Path) -> Iterator[PlannerHarness]:
    """A planner whose worker has planned once, so that it runs and its caches are filled."""
    endpoint = free_endpoint()
    stopping, lead = threading.Event(), LeadTime(ROBOT.tick)
    with Bus(open_session(listen=[endpoint])) as bus, Bus(open_session(connect=[endpoint])) as client:
        library, controller = Library(shipped, ARM, LOG), Controller(client)
        planner = Planner(bus, ROBOT, library, lead, LOG)
        planner.warm_up()
        loop = Loop(bus, planner, library, ROBOT, lead, LOG)
        thread = threading.Thread(target=loop.serve, args=(stopping,))
        thread.start()
        try:
            assert eventually(lambda: client.is_alive("planner"))
            harness = PlannerHarness(client, controller, loop)
            harness.ask(strike(plan_only=True))
            yield harness
        finally:
            stopping.set()
            thread.join()
            controller.close()


@pytest.fixture
def harness(started: PlannerHarness) -> PlannerHarness:
    """The planner, with a controller that has executed nothing."""
    started.controller.executed.clear()
    return started


def test_a_goal_is_planned_and_executed(harness: PlannerHarness) -> None:
    """Its plan has the paper's 50 functions and no certificate."""
    reply = harness.ask(strike(goal_id="one"))
    assert (reply.report.certified, reply.report.basis_count) == (False, 50)
    assert harness.controller.executed == ["one"]


def test_a_goal_of_method_qp_does_not_wait_for_it(harness: PlannerHarness) -> None:
    with harness.planning(strike(plan_only=True)) as slow:
        assert harness.ask(strike(method="qp", plan_only=True)).report.certified
    assert not slow().report.certified


def test_a_goal_overtaken_by_a_later_one_is_superseded(harness: PlannerHarness) -> None:
    with harness.planning(strike(goal_id="slow")) as slow:
        harness.ask(strike(method="qp", goal_id="quick"))
    refusal = harness.refusal(slow)
    assert (refusal.code, refusal.detail) == ("superseded", {"goal_id": "slow", "cause": "plan"})
    assert harness.controller.executed == ["quick"]
    harness.ask(strike(goal_id="next"))
    assert harness.controller.executed == ["quick", "next"]


@pytest.mark.parametrize(("code", "detail"), [("late", {}), ("superseded", {"cause": "plan"})])
def test_a_plan_that_is_late_or_superseded_is_made_once_more(
    harness: PlannerHarness, code: str, detail: dict[str, str]
) -> None:
    """It is not made a third time, nor again after another refusal."""
    refusal = Refusal(code, "no", goal_id="g", **detail)
    harness.controller.refuse[:], before = [refusal], harness.controller.references
    harness.ask(strike(goal_id=f"again, {code}"))
    assert harness.controller.executed == [f"again, {code}"]
    assert harness.controller.references == before + 2
    harness.controller.refuse[:] = [refusal, refusal]
    assert harness.refusal(harness.send(strike(goal_id=f"never, {code}"))).code == code
    harness.controller.refuse[:] = [Refusal("busy", "no", goal_id="g")]
    assert harness.refusal(harness.send(strike(goal_id=f"busy, {code}"))).code == "busy"
    assert harness.controller.executed == [f"again, {code}"]


def test_a_repeated_goal_is_executed_once(harness: PlannerHarness) -> None:
    """Also while it is planned; a different goal with its id is refused as a duplicate."""
    with harness.planning(strike(goal_id="twice")) as first:
        second, other = harness.send(strike(goal_id="twice")), harness.send(strike(goal_id="twice", duration=1.1))
        assert eventually(lambda: len(harness.loop.repeated["twice"]) == 2)
    answer = first()
    assert answer == second()
    assert harness.refusal(other).code == "duplicate"
    assert harness.ask(strike(goal_id="twice")) == answer
    assert harness.controller.executed == ["twice"]


def test_a_malformed_goal_is_refused_without_waiting(harness: PlannerHarness) -> None:
    with harness.planning(strike(plan_only=True)) as slow:
        assert harness.refusal(harness.send(strike(duration=-1.0))).code == "invalid_goal"
    slow()


def test_a_goal_that_cannot_be_planned_is_refused_with_its_joint(harness: PlannerHarness) -> None:
    refusal = harness.refusal(harness.send(strike(duration=0.05)))
    assert refusal.code in ("infeasible", "cannot_stop", "limit")
    assert refusal.detail["joint"] in ROBOT.joint_names


def test_the_death_of_the_worker_is_reported_and_another_one_started(harness: PlannerHarness) -> None:
    """Nothing is executed until the goal is sent again."""
    first = harness.pid
    with harness.planning(strike(goal_id="lost")) as answer:
        os.kill(first, signal.SIGKILL)
    refusal = harness.refusal(answer)
    assert (refusal.code, refusal.detail) == ("unavailable", {"service": "planner", "goal_id": "lost"})
    assert "the plan process died; send this again" in refusal.message
    assert harness.controller.executed == []
    harness.ask(strike(goal_id="lost"))
    assert harness.controller.executed == ["lost"]
    assert harness.pid != first


def test_an_error_of_the_link_to_the_process_is_a_refusal(
    harness: PlannerHarness, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The goal and its repetition are refused, and the next goal is planned."""

    def fail(_: Task) -> SampledPlan:
        raise pickle.UnpicklingError("invalid load key")

    monkeypatch.setattr(harness.loop.plan_worker, "plan", fail)
    for _ in range(2):
        refusal = harness.refusal(harness.send(strike(goal_id="garbled")))
        assert (refusal.code, refusal.detail) == ("unavailable", {"service": "planner", "goal_id": "garbled"})
    monkeypatch.undo()
    harness.ask(strike(goal_id="garbled"))
    assert harness.controller.executed == ["garbled"]
