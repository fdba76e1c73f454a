"""Learning beside the planner's loop: a worker process fits, a thread waits for it and writes the file."""

import logging
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any

import msgspec

from motion.plan import prepare
from protocol import messages as m
from protocol.bus.bus import PendingQuery
from protocol.bus.queues import Inbox
from protocol.errors import Refusal
from protocol.topics import QUEUE_LENGTH
from services.planner.learning import learned_message
from services.planner.library import Library, Written
from services.planner.worker import OWN_ERROR
from services.planner.worker_link import Worker

CLOSING_S = 1.0
"""How long the planner, when it ends, waits for the thread."""


class Head(msgspec.Struct):
    """What the planner's loop reads of a `learn` request: the rest of its body may be long.

    A name that is missing is refused by the worker, with all that it finds.
    """

    name: str | None = None
    replace: bool = False


class Errand:
    """Work that a thread has done in the planner's loop, which alone changes its state."""

    def __init__(self, work: Callable[[], None]) -> None:
        self._work = work
        self._done = threading.Event()
        self._error: Exception | None = None

    def run(self) -> None:
        """Do the work, in the loop."""
        try:
            self._work()
        except Exception as error:
            self._error = error
        self._done.set()

    def wait(self) -> None:
        """Wait until it is done, and raise what it raised."""
        self._done.wait()
        if self._error is not None:
            raise self._error


@dataclass(frozen=True, slots=True, eq=False)
class _Request:
    asking: PendingQuery
    head: Head
    body: memoryview


class Learner:
    """Answers `learn` requests, one at a time, without the planner's loop.

    `keep` takes what is written into the library; it is called in the loop, through `inbox`, and may refuse.
    """

    def __init__(
        self,
        library: Library,
        worker: Worker,
        keep: Callable[[Written, bool], None],
        inbox: Inbox[Any],
        log: logging.Logger,
    ) -> None:
        self._library = library
        self._worker = worker
        self._keep = keep
        self._inbox = inbox
        self._log = log
        self._closing = False
        self._waiting: SimpleQueue[_Request | None] = SimpleQueue()
        # The kernel ends the worker with the thread that started it: so it is this one.
        self._thread = threading.Thread(target=self._run, name="learner", daemon=True)
        self._thread.start()

    def submit(self, asking: PendingQuery, head: Head, body: memoryview) -> None:
        """Learn and answer when those before are done.

        Raises:
            Refusal: `busy` where too many wait.
        """
        if self._waiting.qsize() >= QUEUE_LENGTH:
            raise Refusal(
                "busy", f"{QUEUE_LENGTH} demonstrations wait to be learned; send this one later", goal_id=None
            )
        self._waiting.put(_Request(asking, head, body))

    def close(self) -> None:
        """End the worker and forget what waits."""
        self._closing = True
        self._waiting.put(None)
        self._worker.kill()
        self._thread.join(CLOSING_S)

    def _run(self) -> None:
        for entry in list(self._library):
            with suppress(Refusal):  # it was forgotten meanwhile
                if not self._closing:
                    prepare(self._library.get(entry.name))
        while (request := self._waiting.get()) is not None and not self._closing:
            try:
                self._answer(request)
            except Exception:  # such as a session that is closed: the next one must be answered all the same
                self._log.exception("the answer to learn was lost", extra={"goal_id": None})
        self._worker.close()

    def _answer(self, request: _Request) -> None:
        try:
            request.asking.reply(self._learn(request))
            return
        except Refusal as reason:
            refusal = reason
        except Exception:
            self._log.exception("learn met an error of the planner", extra={"goal_id": None})
            refusal = Refusal("unavailable", OWN_ERROR, service="planner")
        request.asking.refuse(refusal)
        fields = {"goal_id": None, "code": refusal.code}
        self._log.info("learn refused as %s: %s", refusal.code, refusal, extra=fields)

    def _learn(self, request: _Request) -> m.Learned:
        lesson, name = self._worker.learn(request.body), request.head.name
        assert name is not None
        prepare(lesson.primitive)
        written = self._library.write(name, lesson.primitive)
        try:
            self._in_loop(lambda: self._keep(written, request.head.replace))
        except Refusal:
            written.temporary.unlink(missing_ok=True)
            raise
        self._library.sync()
        shape = name, lesson.primitive.duration, lesson.primitive.joint_count, lesson.primitive.basis_count
        self._log.info("learned %s: %.3f s, %d joints, %d functions each", *shape)
        for sentence in lesson.warnings:
            self._log.warning("%s: %s", name, sentence)
        return learned_message(name, lesson.primitive, lesson.warnings)

    def _in_loop(self, work: Callable[[], None]) -> None:
        """Have `work` done by the planner's loop, and wait for it."""
        errand = Errand(work)
        while not self._inbox.offer(errand):
            if self._closing:
                raise Refusal("unavailable", "the planner ends; nothing changed", service="planner")
            time.sleep(0.01)
        errand.wait()
