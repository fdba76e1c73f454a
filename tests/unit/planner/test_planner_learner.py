"""Learning beside the planner's loop: a thread learns one demonstration after another."""

import logging
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from protocol import messages as m
from protocol import topics
from protocol.bus.queues import Inbox
from protocol.errors import Refusal
from services.planner.learner import Head, Learner
from services.planner.library import Arm, Library, Written
from services.planner.worker import Lesson, learned
from services.planner.worker_thread import LoopCall
from tests.unit.planner.test_planner_worker import LIMITS, NAMES, body
from tests.waiting import eventually

LOG = logging.getLogger("planner")
ARM = Arm("two", NAMES)


class Question:
    """A request that keeps its answer."""

    topic = topics.LEARN

    def __init__(self) -> None:
        self.answer: Any = None
        self.answered = threading.Event()

    def reply(self, answer: object) -> None:
        """Keep the answer."""
        self.answer = answer
        self.answered.set()

    refuse = reply


class HeldWorker:
    """A worker that learns in this process once a test permits it."""

    role = "learn"

    def __init__(self) -> None:
        self.may = threading.Semaphore(0)
        self.asked: list[bytes] = []

    def learn(self, asked: bytes) -> Lesson:
        """Wait for the permission, then learn."""
        self.asked.append(asked)
        self.may.acquire()
        return learned(asked, LIMITS, NAMES)

    def kill(self) -> None:
        """Permit the present request, so that it ends."""
        self.may.release()

    def close(self) -> None:
        """Do nothing: there is no process."""


class Desk:
    """A learner, whose library is kept as the planner's loop keeps it."""

    def __init__(self, folder: Path) -> None:
        self.library = Library(folder, ARM, LOG)
        self.worker = HeldWorker()
        self.inbox: Inbox[Any] = Inbox()
        self.learner = Learner(self.library, self.worker, self.keep, self.inbox, LOG)  # type: ignore[arg-type]

    def keep(self, written: Written, replace: bool) -> None:
        """Keep a primitive as the planner does."""
        self.library.check_name(written.name, replace)
        self.library.keep(written)

    def submit(self, name: str = "wave", replace: bool = False, sent: bytes | None = None) -> Question:
        """Submit a demonstration to be learned."""
        question = Question()
        self.learner.submit(question, Head(name, replace), sent or body(name))  # type: ignore[arg-type]
        return question

    def serve(self, question: Question) -> Any:
        """Permit the next request, run the learner's calls until `question` is answered, and return the answer."""
        self.worker.may.release()
        while not question.answered.is_set():
            call = self.inbox.take(0.01)
            if call is not None:
                assert isinstance(call, LoopCall)
                call.run()
        return question.answer


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    """A learner beside a loop that does nothing else."""
    desk = Desk(tmp_path)
    yield desk
    desk.learner.close()


def test_what_is_learned_is_on_disk_before_it_is_said(desk: Desk, tmp_path: Path):
    reply = desk.serve(desk.submit())
    assert isinstance(reply, m.Learned)
    assert (reply.name, reply.samples, reply.warnings) == ("wave", 101, reply.warnings)
    assert [entry.name for entry in Library(tmp_path, ARM, LOG)] == ["wave"]
    assert desk.library.get("wave").samples == 101


def test_while_one_is_learned_the_loop_is_free(desk: Desk):
    """The loop's queue stays empty until there is a primitive to keep."""
    question = desk.submit()
    assert desk.inbox.take(0.1) is None
    assert not question.answered.is_set()
    desk.serve(question)


def test_several_are_learned_in_turn(desk: Desk):
    questions = [desk.submit(name) for name in ("one", "two", "three")]
    for question, name in zip(questions, ("one", "two", "three"), strict=True):
        assert desk.serve(question).name == name
    assert len(desk.worker.asked) == 3


def test_of_two_with_one_name_the_second_exists(desk: Desk, tmp_path: Path):
    """The name was free when both were submitted; only `replace` overwrites it."""
    first, second, third = desk.submit(), desk.submit(), desk.submit(replace=True)
    assert isinstance(desk.serve(first), m.Learned)
    assert desk.serve(second).code == "exists"
    assert isinstance(desk.serve(third), m.Learned)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["wave.npz"]


def test_one_that_fails_leaves_the_name_free(desk: Desk):
    first, second = desk.submit(sent=b"{"), desk.submit()
    assert desk.serve(first).code == "bad_message"
    assert isinstance(desk.serve(second), m.Learned)


def test_what_is_forgotten_meanwhile_comes_back(desk: Desk, tmp_path: Path):
    """In memory and on disk alike."""
    desk.serve(desk.submit())
    question = desk.submit(replace=True)
    desk.library.remove("wave")
    assert isinstance(desk.serve(question), m.Learned)
    assert [entry.name for entry in desk.library] == [entry.name for entry in Library(tmp_path, ARM, LOG)] == ["wave"]


def test_too_many_are_busy(desk: Desk):
    desk.submit()
    assert eventually(lambda: desk.worker.asked)
    for number in range(16):
        desk.submit(f"n{number}")
    with pytest.raises(Refusal, match="16 requests wait") as caught:
        desk.submit("last")
    assert caught.value.code == "busy"


def test_an_error_that_nobody_foresaw_is_one_request_s(desk: Desk, monkeypatch: pytest.MonkeyPatch):
    def broken(*_: object) -> Callable[[], None]:
        raise ZeroDivisionError

    with monkeypatch.context() as patched:
        patched.setattr(desk.library, "write", broken)
        refusal = desk.serve(desk.submit())
    assert (refusal.code, refusal.detail) == ("unavailable", {"service": "planner"})
    assert isinstance(desk.serve(desk.submit()), m.Learned)
