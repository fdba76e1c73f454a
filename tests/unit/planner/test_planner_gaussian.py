"""Goals of the method "gaussian" are planned beside the planner's loop, on a real bus and in a real process.

What happens while such a goal is planned is tested with that process stopped, so that no test depends on its speed.
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
from tests.waiting import PATIENCE_S, eventually

LOG = logging.getLogger("planner")
ROBOT = load_robot()
ARM = Arm(ROBOT.name, ROBOT.joint_names)
HOME, STILL = ROBOT.home.tolist(), [0.0] * ROBOT.joint_count
STRIKE: dict[str, Any] = {"primitive": "forehand", "positions": list(HIT), "velocities": list(HIT_VELOCITIES)}


def strike(**fields: Any) -> m.Goal:
    """The forehand by the paper's own formulation, unless `fields` say otherwise."""
    return m.Goal(**{**STRIKE, "method": "gaussian", **fields})


class Controller:
    """A controller at rest that accepts what is planned under its newest epoch; its clock stands still."""

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
            asking = self._inbox.take(0.02)
            if asking is None:
                continue
            try:
                asking.reply(self._answer(asking.decode()))
            except Refusal as refusal:
                asking.refuse(refusal)

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


class Desk:
    """A client, the controller, and the planner's loop between them."""

    def __init__(self, client: Bus, controller: Controller, loop: Loop) -> None:
        self.controller = controller
        self.loop = loop
        self._client = client

    def send(self, goal: m.Goal) -> Callable[[], m.GoalReply]:
        """Send a goal; what is returned waits for its answer."""
        return self._client.send(topics.GOAL, goal, PATIENCE_S)

    def ask(self, goal: m.Goal) -> m.GoalReply:
        """Send a goal and wait for its answer."""
        return self.send(goal)()

    def refusal(self, answer: Callable[[], m.GoalReply]) -> Refusal:
        """The refusal of a goal that was sent."""
        with pytest.raises(Refusal) as caught:
            answer()
        return caught.value

    @property
    def pid(self) -> int:
        """Of the process that plans, 0 without one."""
        process = self.loop.plan_worker.process
        return process.pid if process else 0

    @contextmanager
    def planning(self, goal: m.Goal) -> Iterator[Callable[[], m.GoalReply]]:
        """Send a goal whose plan is not made before the block ends; what is yielded waits for its answer."""
        os.kill(self.pid, signal.SIGSTOP)
        try:
            answer = self.send(goal)
            assert eventually(self._has_sent_the_task)
            yield answer
        finally:
            os.kill(self.pid, signal.SIGCONT)

    def _has_sent_the_task(self) -> bool:
        """Whether bytes lie unread in the socket of the process that plans."""
        connection = self.loop.plan_worker.connection
        assert connection
        return unread(connection.fileno()) > 0


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A library that knows the forehand."""
    folder = tmp_path_factory.mktemp("library")
    forehand = learn_from_csv(DEMONSTRATIONS / "forehand.csv", ROBOT.joint_names)
    assert forehand is not None
    Library(folder, ARM, LOG).put("forehand", forehand)
    return folder


@pytest.fixture(scope="module")
def started(shipped: Path) -> Iterator[Desk]:
    """A planner whose process has planned once, so that it is there and its caches are full."""
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
            desk = Desk(client, controller, loop)
            desk.ask(strike(plan_only=True))
            yield desk
        finally:
            stopping.set()
            thread.join()
            controller.close()


@pytest.fixture
def desk(started: Desk) -> Desk:
    """The planner, and a controller that has played nothing."""
    started.controller.executed.clear()
    return started


def test_it_is_played(desk: Desk) -> None:
    """Not certified, with the paper's number of functions; the motion begins when the plan is there."""
    reply = desk.ask(strike(goal_id="one"))
    assert (reply.report.certified, reply.report.basis_count) == (False, 50)
    assert desk.controller.executed == ["one"]


def test_a_goal_of_the_other_method_does_not_wait(desk: Desk) -> None:
    """It is answered while the one before it is planned."""
    with desk.planning(strike(plan_only=True)) as slow:
        assert desk.ask(strike(method="qp", plan_only=True)).report.certified
    assert not slow().report.certified


def test_a_later_goal_is_not_replaced_by_an_earlier_one(desk: Desk) -> None:
    """What came last is played, however long the one before it took."""
    with desk.planning(strike(goal_id="slow")) as slow:
        desk.ask(strike(method="qp", goal_id="quick"))
    refusal = desk.refusal(slow)
    assert (refusal.code, refusal.detail) == ("superseded", {"goal_id": "slow", "cause": "plan"})
    assert desk.controller.executed == ["quick"]
    desk.ask(strike(goal_id="next"))
    assert desk.controller.executed == ["quick", "next"]


@pytest.mark.parametrize(("code", "detail"), [("late", {}), ("superseded", {"cause": "plan"})])
def test_a_plan_that_is_late_or_overtaken_is_made_once_more(desk: Desk, code: str, detail: dict[str, str]) -> None:
    """But not twice, and not for another reason."""
    refusal = Refusal(code, "no", goal_id="g", **detail)
    desk.controller.refuse[:], before = [refusal], desk.controller.references
    desk.ask(strike(goal_id=f"again, {code}"))
    assert desk.controller.executed == [f"again, {code}"]
    assert desk.controller.references == before + 2
    desk.controller.refuse[:] = [refusal, refusal]
    assert desk.refusal(desk.send(strike(goal_id=f"never, {code}"))).code == code
    desk.controller.refuse[:] = [Refusal("busy", "no", goal_id="g")]
    assert desk.refusal(desk.send(strike(goal_id=f"busy, {code}"))).code == "busy"
    assert desk.controller.executed == [f"again, {code}"]


def test_a_goal_sent_twice_moves_the_arm_once(desk: Desk) -> None:
    """Also while it is planned; another one of its id is a duplicate."""
    with desk.planning(strike(goal_id="twice")) as first:
        second, other = desk.send(strike(goal_id="twice")), desk.send(strike(goal_id="twice", duration=1.1))
        assert eventually(lambda: len(desk.loop.repeated["twice"]) == 2)
    answer = first()
    assert answer == second()
    assert desk.refusal(other).code == "duplicate"
    assert desk.ask(strike(goal_id="twice")) == answer
    assert desk.controller.executed == ["twice"]


def test_what_is_malformed_waits_for_nothing(desk: Desk) -> None:
    """It is refused before its turn."""
    with desk.planning(strike(plan_only=True)) as slow:
        assert desk.refusal(desk.send(strike(duration=-1.0))).code == "invalid_goal"
    slow()


def test_what_cannot_be_planned_is_refused(desk: Desk) -> None:
    """By what stands in its way, joints by name, as every other goal."""
    refusal = desk.refusal(desk.send(strike(duration=0.05)))
    assert refusal.code in ("infeasible", "cannot_stop", "limit")
    assert refusal.detail["joint"] in ROBOT.joint_names


def test_a_process_that_dies_is_named_and_replaced(desk: Desk) -> None:
    """Nothing moves, and the same goal sent again is played."""
    first = desk.pid
    with desk.planning(strike(goal_id="lost")) as answer:
        os.kill(first, signal.SIGKILL)
    refusal = desk.refusal(answer)
    assert (refusal.code, refusal.detail) == ("unavailable", {"service": "planner"})
    assert "the plan process died; send this again" in refusal.message
    assert desk.controller.executed == []
    desk.ask(strike(goal_id="lost"))
    assert desk.controller.executed == ["lost"]
    assert desk.pid != first


def test_an_error_of_the_link_to_the_process_is_a_refusal(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """The goal and its repetition are refused, and the next goal is planned."""

    def fail(_: Task) -> SampledPlan:
        raise pickle.UnpicklingError("invalid load key")

    monkeypatch.setattr(desk.loop.plan_worker, "plan", fail)
    for _ in range(2):
        refusal = desk.refusal(desk.send(strike(goal_id="garbled")))
        assert (refusal.code, refusal.detail) == ("unavailable", {"service": "planner", "goal_id": "garbled"})
    monkeypatch.undo()
    desk.ask(strike(goal_id="garbled"))
    assert desk.controller.executed == ["garbled"]
