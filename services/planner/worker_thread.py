"""Work beside the planner's loop: a worker process computes, a thread waits for it, one piece of work after another."""

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, wait
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

from protocol.bus.queues import Inbox
from protocol.errors import Refusal
from protocol.topics import QUEUE_LENGTH
from services.planner.worker_link import Worker

CLOSING_S = 1.0
"""How long the planner, when it ends, waits for the thread."""

LOOK_S = 0.05
"""How often a thread that waits for the loop looks whether the planner ends."""

ResultT = TypeVar("ResultT")


class LoopCall(Generic[ResultT]):
    """Work that a thread has done in the planner's loop, which alone changes its state."""

    def __init__(self, work: Callable[[], ResultT]) -> None:
        self._work = work
        self._future: Future[ResultT] = Future()

    def run(self) -> None:
        """Do the work, in the loop."""
        try:
            self._future.set_result(self._work())
        except Exception as error:
            self._future.set_exception(error)

    def wait(self, given_up: Callable[[], bool]) -> ResultT:
        """Wait until it is done; return what it returned, or raise what it raised.

        Raises:
            Refusal: `unavailable` where it was `given_up`, since the planner ends.
        """
        while not wait([self._future], LOOK_S).done:
            if given_up():
                raise Refusal("unavailable", "the planner ends; nothing changed", service="planner")
        return self._future.result()


class WorkerThread:
    """A thread that does what is submitted, in turn, with a `worker` process of its own."""

    def __init__(self, worker: Worker, inbox: Inbox[Any], log: logging.Logger) -> None:
        self._worker = worker
        self._inbox = inbox
        self._log = log
        self._queue: SimpleQueue[Callable[[], object] | None] = SimpleQueue()
        self.closing = False
        # The kernel ends the worker with the thread that started it: so it is this one.
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def submit(self, work: Callable[[], object]) -> None:
        """Have `work` done in the thread, after what was submitted before.

        Raises:
            Refusal: `busy` where too much waits.
        """
        if self._queue.qsize() >= QUEUE_LENGTH:
            sentence = f"{QUEUE_LENGTH} requests wait for the {self._worker.role} process; send this one later"
            raise Refusal("busy", sentence, goal_id=None)
        self._queue.put(work)

    def in_loop(self, work: Callable[[], ResultT]) -> ResultT:
        """Have `work` done by the planner's loop, wait for it, and return its result.

        Raises:
            Refusal: `unavailable` where the planner ends; and whatever the work raises.
        """
        call = LoopCall(work)
        while not self._inbox.offer(call) and not self.closing:
            time.sleep(0.01)
        return call.wait(lambda: self.closing)

    def close(self) -> None:
        """End the process and forget what waits."""
        self.closing = True
        self._queue.put(None)
        self._worker.kill()
        self._thread.join(CLOSING_S)

    def _run(self) -> None:
        while (work := self._queue.get()) is not None and not self.closing:
            try:
                work()
            except Exception:  # such as a session that is closed: the next one must be answered all the same
                self._log.exception("an answer of the %s process was lost", self._worker.role, extra={"goal_id": None})
        self._worker.close()
