"""The worker processes that learn and plan, and the planner's connection to them."""

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
from tools.drill.harness.waiting import eventually

LOG = logging.getLogger("planner")
LIMITS = Limits(np.array([[-1.0, 1.0], [-1.0, 1.0]]), np.full(2, 5.0), np.full(2, 50.0), np.full(2, 500.0))
NAMES = ("a", "b")
TIMES = np.linspace(0, 1, 101)
PATH = np.stack([0.5 * np.sin(np.pi * TIMES) ** 2, 0.1 * TIMES], axis=1)


def body(name: str = "wave", positions: np.ndarray = PATH, **more: Any) -> bytes:
    """Return a `learn` request of two joints at 100 Hz."""
    return encode(m.Learn(name=name, positions=positions.tolist(), rate=100.0, **more))


# --- functions of the worker process ---------------------------------------------------------------------


def test_what_is_learned_has_warnings_about_the_demonstration():
    lesson = learned(body(positions=PATH + np.array([0.0, 1.2])), LIMITS, NAMES)
    assert lesson.primitive.joint_count == 2
    assert any(sentence.startswith("b reaches 1.3 rad, outside its range") for sentence in lesson.warnings)


@pytest.mark.parametrize(
    ("sent", "field"),
    [(b"{", ""), (encode(m.Learn(name="w", positions=[[0.0, 0.0]], rate=1.0)), "rate"), (body(times=[0.0]), "rate")],
)
def test_a_malformed_request_is_refused_with_its_field(sent: bytes, field: str):
    failure = outcome(learned, sent, LIMITS, NAMES)
    assert isinstance(failure, Failure)
    assert (failure.code, failure.detail, failure.report) == ("bad_message", {"field": field}, "")


def test_an_unexpected_error_is_reported_with_its_traceback(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("services.planner.worker.warnings_of", None)
    failure = outcome(learned, body(), LIMITS, NAMES)
    assert isinstance(failure, Failure)
    assert (failure.code, failure.detail) == ("unavailable", {"service": "planner"})
    assert "TypeError" in failure.report


# --- the learning process --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def worker() -> Iterator[Worker]:
    """A worker that learns; it starts another process if a test ended the previous one."""
    worker = Worker("learn", LIMITS, NAMES, LOG)
    yield worker
    worker.close()


def pid_of(worker: Worker) -> int:
    """Return the id of the worker's process."""
    assert worker.process is not None
    return worker.process.pid


def test_the_worker_learns_the_same_as_this_process(worker: Worker):
    here = learned(body(), LIMITS, NAMES)
    there = worker.learn(body())
    assert np.allclose(there.primitive.control_points, here.primitive.control_points, atol=1e-9)
    assert there.warnings == here.warnings
    first = pid_of(worker)
    with pytest.raises(Refusal) as caught:
        worker.learn(b"{")
    assert caught.value.code == "bad_message"
    assert pid_of(worker) == first


def test_closing_a_worker_is_not_logged_as_a_death(worker: Worker, caplog: pytest.LogCaptureFixture):
    caplog.set_level(logging.INFO)
    worker.learn(body())
    worker.close()
    assert caplog.text == ""


def test_a_process_that_died_is_replaced_at_the_next_request(worker: Worker):
    worker.learn(body())
    first = pid_of(worker)
    os.kill(first, signal.SIGKILL)
    os.waitid(os.P_PID, first, os.WEXITED | os.WNOWAIT)
    assert worker.learn(body()).primitive.samples == 101
    assert pid_of(worker) != first


def kill_at_next_request(worker: Worker) -> None:
    """Suspend the worker's process, and kill it once an unread request is in its socket."""
    os.kill(pid_of(worker), signal.SIGSTOP)
    connection = worker.connection
    assert connection is not None

    def kill() -> None:
        eventually(lambda: unread(connection.fileno()))
        worker.kill()

    threading.Thread(target=kill).start()


def test_learning_in_a_process_that_dies_is_unavailable(worker: Worker):
    """The next request is served by another process."""
    worker.learn(body())
    kill_at_next_request(worker)
    with pytest.raises(Refusal, match="send this again") as caught:
        worker.learn(body())
    assert (caught.value.code, caught.value.detail) == ("unavailable", {"service": "planner"})
    assert worker.learn(body()).primitive.samples == 101


def test_the_process_ends_when_the_planner_is_killed():
    """A stand-in for the planner starts a worker, sends it a long fit, and is killed."""
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
    assert eventually(lambda: not is_running(number)), "the worker process outlived the planner"


# --- planning -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def task() -> Task:
    """A motion of two joints along the primitive of PATH, feasible within the limits."""
    primitive, free = learned(body(), LIMITS, NAMES).primitive, np.full(2, np.nan)
    start = Boundary(primitive.start.positions, np.zeros(2), np.zeros(2))
    goal = Boundary(primitive.goal.positions, np.zeros(2), free)
    return Task(primitive, MotionRequest(start, goal, 1.0, LIMITS), 0.001, Joints(tuple(NAMES), (False,) * len(NAMES)))


@pytest.fixture(scope="module")
def planner() -> Iterator[Worker]:
    """A worker that plans; it starts another process if a test ended the previous one."""
    worker = Worker("plan", LIMITS, NAMES, LOG)
    yield worker
    worker.close()


def test_the_worker_plans_the_same_as_this_process(planner: Worker, task: Task):
    here = plan_gaussian(task.primitive, task.request, task.tick, margin=SAFETY_MARGIN)
    there = planner.plan(task)
    assert there.samples().positions == pytest.approx(here.samples().positions, abs=1e-9)
    assert there.request.goal.positions.tolist() == task.request.goal.positions.tolist()


def test_an_infeasible_task_is_refused_with_the_joints_name(planner: Worker, task: Task):
    with pytest.raises(Refusal) as caught:
        planner.plan(replace(task, request=replace(task.request, duration=0.02)))
    assert caught.value.code == "infeasible"
    assert caught.value.detail["joint"] in NAMES
    assert caught.value.message.startswith(caught.value.detail["joint"])


def test_a_plan_of_a_process_that_dies_is_unavailable(planner: Worker, task: Task):
    planner.plan(task)
    kill_at_next_request(planner)
    with pytest.raises(Refusal, match="the plan process died; send this again") as caught:
        planner.plan(task)
    assert (caught.value.code, caught.value.detail) == ("unavailable", {"service": "planner"})
    assert planner.plan(task).hit_index == 1000
