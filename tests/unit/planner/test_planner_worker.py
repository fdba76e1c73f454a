"""The processes that learn and plan, and the planner's connection to them."""

import logging
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from motion.gaussian import SAFETY_MARGIN, plan_gaussian
from motion.limits import Limits
from motion.request import Boundary, MotionRequest
from protocol import messages as m
from protocol.codec import encode
from protocol.errors import Refusal
from services.planner.refusals import Joints
from services.planner.worker import Failure, Task, learned, outcome
from services.planner.worker_link import Worker
from tests.connections import unread
from tests.processes import is_running
from tests.waiting import eventually

LOG = logging.getLogger("planner")
LIMITS = Limits(np.array([[-1.0, 1.0], [-1.0, 1.0]]), np.full(2, 5.0), np.full(2, 50.0), np.full(2, 500.0))
NAMES = ("a", "b")
TIMES = np.linspace(0, 1, 101)
PATH = np.stack([0.5 * np.sin(np.pi * TIMES) ** 2, 0.1 * TIMES], axis=1)


def body(name: str = "wave", positions: np.ndarray = PATH, **more: Any) -> bytes:
    """A request of two joints at 100 Hz."""
    return encode(m.Learn(name=name, positions=positions.tolist(), rate=100.0, **more))


# --- what the process does ------------------------------------------------------------------------------


def test_a_lesson_warns():
    lesson = learned(body(positions=PATH + np.array([0.0, 1.2])), LIMITS, NAMES)
    assert lesson.primitive.joint_count == 2
    assert any(sentence.startswith("b reaches 1.3 rad, outside its range") for sentence in lesson.warnings)


@pytest.mark.parametrize(
    ("sent", "field"),
    [(b"{", ""), (encode(m.Learn(name="w", positions=[[0.0, 0.0]], rate=1.0)), "rate"), (body(times=[0.0]), "rate")],
)
def test_a_bad_request_is_refused_by_field(sent: bytes, field: str):
    failure = outcome(learned, sent, LIMITS, NAMES)
    assert isinstance(failure, Failure)
    assert (failure.code, failure.detail, failure.report) == ("bad_message", {"field": field}, "")


def test_an_error_that_nobody_foresaw_is_reported(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("services.planner.worker.warnings_of", None)
    failure = outcome(learned, body(), LIMITS, NAMES)
    assert isinstance(failure, Failure)
    assert (failure.code, failure.detail) == ("unavailable", {"service": "planner"})
    assert "TypeError" in failure.report


# --- the process itself ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def worker() -> Iterator[Worker]:
    """A process that learns; where a test ends it, the next one that learns starts another."""
    worker = Worker("learn", LIMITS, NAMES, LOG)
    yield worker
    worker.close()


def pid_of(worker: Worker) -> int:
    """The number of its process."""
    assert worker.process is not None
    return worker.process.pid


def test_it_learns_what_this_process_would(worker: Worker):
    here = learned(body(), LIMITS, NAMES)
    there = worker.learn(body())
    assert np.allclose(there.primitive.control_points, here.primitive.control_points, atol=1e-9)
    assert there.warnings == here.warnings
    first = pid_of(worker)
    with pytest.raises(Refusal) as caught:
        worker.learn(b"{")
    assert caught.value.code == "bad_message"
    assert pid_of(worker) == first


def test_a_process_that_is_ended_did_not_die(worker: Worker, caplog: pytest.LogCaptureFixture):
    """The log reports no exit status, because the planner ended the process."""
    caplog.set_level(logging.INFO)
    worker.learn(body())
    worker.close()
    assert caplog.text == ""


def test_a_process_that_died_is_replaced(worker: Worker):
    """Its death is detected only by the next request."""
    worker.learn(body())
    first = pid_of(worker)
    os.kill(first, signal.SIGKILL)
    os.waitid(os.P_PID, first, os.WEXITED | os.WNOWAIT)
    assert worker.learn(body()).primitive.samples == 101
    assert pid_of(worker) != first


def kill_once_asked(worker: Worker) -> None:
    """Suspend its process, and kill it when a request was sent to it that it has not read."""
    os.kill(pid_of(worker), signal.SIGSTOP)
    connection = worker.connection
    assert connection is not None

    def kill() -> None:
        eventually(lambda: unread(connection.fileno()))
        worker.kill()

    threading.Thread(target=kill).start()


def test_what_a_dying_process_learned_is_unavailable(worker: Worker):
    """And the next is learned."""
    worker.learn(body())
    kill_once_asked(worker)
    with pytest.raises(Refusal, match="send this again") as caught:
        worker.learn(body())
    assert (caught.value.code, caught.value.detail) == ("unavailable", {"service": "planner"})
    assert worker.learn(body()).primitive.samples == 101


def test_it_ends_with_the_planner_however_that_ends():
    """A small planner starts a process, sends it a long fit, and is killed."""
    lines = """
import threading, time
import numpy as np
from motion.gaussian import SAFETY_MARGIN, plan_gaussian
from motion.limits import Limits
from motion.request import Boundary, MotionRequest
from services.planner.worker_link import Worker
from tests.unit.planner.test_planner_worker import LIMITS, LOG, NAMES, body
worker = Worker("learn", LIMITS, NAMES, LOG)
worker.learn(body())
print(worker.process.pid, flush=True)
slow = body(positions=np.random.default_rng(0).standard_normal((40_000, 8)))
worker.learn(slow)
time.sleep(60)
"""
    with subprocess.Popen([sys.executable, "-c", lines], stdout=subprocess.PIPE, text=True) as planner:
        assert planner.stdout is not None
        number = int(planner.stdout.readline())
        planner.kill()
    assert eventually(lambda: not is_running(number)), "the process that learns outlived the planner"


# --- planning -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def task() -> Task:
    """A motion of two joints along what is learned of PATH, with room."""
    primitive, free = learned(body(), LIMITS, NAMES).primitive, np.full(2, np.nan)
    start = Boundary(primitive.start.positions, np.zeros(2), np.zeros(2))
    goal = Boundary(primitive.goal.positions, np.zeros(2), free)
    return Task(primitive, MotionRequest(start, goal, 1.0, LIMITS), 0.001, Joints(tuple(NAMES), (False,) * len(NAMES)))


@pytest.fixture(scope="module")
def planner() -> Iterator[Worker]:
    """A process that plans; where a test ends it, the next one that plans starts another."""
    worker = Worker("plan", LIMITS, NAMES, LOG)
    yield worker
    worker.close()


def test_it_plans_what_this_process_would(planner: Worker, task: Task):
    here = plan_gaussian(task.primitive, task.request, task.tick, margin=SAFETY_MARGIN)
    there = planner.plan(task)
    assert there.samples().positions == pytest.approx(here.samples().positions, abs=1e-9)
    assert there.request.goal.positions.tolist() == task.request.goal.positions.tolist()


def test_what_cannot_be_planned_is_refused_by_name(planner: Worker, task: Task):
    """As in the planner's own process."""
    with pytest.raises(Refusal) as caught:
        planner.plan(replace(task, request=replace(task.request, duration=0.02)))
    assert caught.value.code == "infeasible"
    assert caught.value.detail["joint"] in NAMES
    assert caught.value.message.startswith(caught.value.detail["joint"])


def test_a_plan_of_a_dying_process_is_unavailable(planner: Worker, task: Task):
    planner.plan(task)
    kill_once_asked(planner)
    with pytest.raises(Refusal, match="the plan process died; send this again") as caught:
        planner.plan(task)
    assert (caught.value.code, caught.value.detail) == ("unavailable", {"service": "planner"})
    assert planner.plan(task).hit_index == 1000
