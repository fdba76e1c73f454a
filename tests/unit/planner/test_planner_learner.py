"""Learning concurrently with the planner's loop, in a thread that takes one demonstration after another."""

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
from services.planner.worker import LearnedPrimitive, learned
from services.planner.worker_thread import LoopCall
from tests.unit.planner.test_planner_worker import LIMITS, NAMES, body
from tools.drill.harness.waiting import eventually

LOG = logging.getLogger("planner")
ARM = Arm("two", NAMES)


class FakeRequest:
    """A `learn` request that records its answer."""

    topic = topics.LEARN

    def __init__(self) -> None:
        self.answer: Any = None
        self.answered = threading.Event()

    def reply(self, answer: object) -> None:
        """Record the answer."""
        self.answer = answer
        self.answered.set()

    refuse = reply


class HeldWorker:
    """A worker that learns in this process, once permitted by the test."""

    role = "learn"

    def __init__(self) -> None:
        self.may = threading.Semaphore(0)
        self.asked: list[bytes] = []

    def learn(self, asked: bytes) -> LearnedPrimitive:
        """Wait for permission, then learn."""
        self.asked.append(asked)
        self.may.acquire()
        return learned(asked, LIMITS, NAMES)

    def kill(self) -> None:
        """Permit the current request, so that it ends."""
        self.may.release()

    def close(self) -> None:
        """Do nothing: there is no process."""


class LearnerHarness:
    """A learner with a library, which is updated as by the planner's loop."""

    def __init__(self, folder: Path) -> None:
        self.library = Library(folder, ARM, LOG)
        self.worker = HeldWorker()
        self.inbox: Inbox[Any] = Inbox()
        self.learner = Learner(self.library, self.worker, self.keep, self.inbox, LOG)  # type: ignore[arg-type]

    def keep(self, written: Written, replace: bool) -> None:
        """Add a primitive to the library, as the planner does."""
        self.library.check_name(written.name, replace)
        self.library.keep(written)

    def submit(self, name: str = "wave", replace: bool = False, sent: bytes | None = None) -> FakeRequest:
        """Submit a demonstration to be learned."""
        request = FakeRequest()
        self.learner.submit(request, Head(name, replace), sent or body(name))  # type: ignore[arg-type]
        return request

    def serve(self, request: FakeRequest) -> Any:
        """Permit the next request, run the learner's calls until `request` is answered, and return the answer."""
        self.worker.may.release()
        while not request.answered.is_set():
            call = self.inbox.take(0.01)
            if call is not None:
                assert isinstance(call, LoopCall)
                call.run()
        return request.answer


@pytest.fixture
def harness(tmp_path: Path) -> Iterator[LearnerHarness]:
    """A learner whose loop runs only in `serve`."""
    harness = LearnerHarness(tmp_path)
    yield harness
    harness.learner.close()


def test_a_primitive_is_on_disk_before_the_reply(harness: LearnerHarness, tmp_path: Path):
    reply = harness.serve(harness.submit())
    assert isinstance(reply, m.Learned)
    assert (reply.name, reply.samples) == ("wave", 101)
    assert [entry.name for entry in Library(tmp_path, ARM, LOG)] == ["wave"]
    assert harness.library.get("wave").samples == 101


def test_learning_does_not_block_the_loop(harness: LearnerHarness):
    """Its queue stays empty until there is a primitive to add."""
    request = harness.submit()
    assert eventually(lambda: harness.worker.asked)
    assert harness.inbox.take() is None
    assert not request.answered.is_set()
    harness.serve(request)


def test_requests_are_served_in_order(harness: LearnerHarness):
    requests = [harness.submit(name) for name in ("one", "two", "three")]
    for request, name in zip(requests, ("one", "two", "three"), strict=True):
        assert harness.serve(request).name == name
    assert len(harness.worker.asked) == 3


def test_of_two_requests_with_the_same_name_the_second_is_refused(harness: LearnerHarness, tmp_path: Path):
    """The name was free when both were submitted; `replace` overwrites it."""
    first, second, third = harness.submit(), harness.submit(), harness.submit(replace=True)
    assert isinstance(harness.serve(first), m.Learned)
    assert harness.serve(second).code == "exists"
    assert isinstance(harness.serve(third), m.Learned)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["wave.npz"]


def test_a_failed_request_leaves_its_name_free(harness: LearnerHarness):
    first, second = harness.submit(sent=b"{"), harness.submit()
    assert harness.serve(first).code == "bad_message"
    assert isinstance(harness.serve(second), m.Learned)


def test_a_primitive_forgotten_while_it_is_learned_again_exists_afterwards(harness: LearnerHarness, tmp_path: Path):
    """In memory and on disk."""
    harness.serve(harness.submit())
    request = harness.submit(replace=True)
    harness.library.remove("wave")
    assert isinstance(harness.serve(request), m.Learned)
    assert (
        [entry.name for entry in harness.library] == [entry.name for entry in Library(tmp_path, ARM, LOG)] == ["wave"]
    )


def test_requests_beyond_the_queue_are_refused_as_busy(harness: LearnerHarness):
    harness.submit()
    assert eventually(lambda: harness.worker.asked)
    for number in range(16):
        harness.submit(f"n{number}")
    with pytest.raises(Refusal, match="16 requests wait") as caught:
        harness.submit("last")
    assert caught.value.code == "busy"


def test_an_unexpected_error_fails_only_its_request(harness: LearnerHarness, monkeypatch: pytest.MonkeyPatch):
    def broken(*_: object) -> Callable[[], None]:
        raise ZeroDivisionError

    with monkeypatch.context() as patched:
        patched.setattr(harness.library, "write", broken)
        refusal = harness.serve(harness.submit())
    assert (refusal.code, refusal.detail) == ("unavailable", {"service": "planner"})
    assert isinstance(harness.serve(harness.submit()), m.Learned)
