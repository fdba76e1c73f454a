"""A thread beside the planner's loop that gives work to a worker process and waits for it, one piece at a time."""

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
"""Timeout for the thread when the planner ends."""

LOOK_S = 0.05
"""Period with which a thread that waits for the loop checks whether the planner ends."""

ResultT = TypeVar("ResultT")


class LoopCall(Generic[ResultT]):
    """Work of a thread that must run in the planner's loop, because only the loop changes the planner's state."""

    def __init__(self, work: Callable[[], ResultT]) -> None:
        self._work = work
        self._future: Future[ResultT] = Future()

    def run(self) -> None:
        """Run the work; called in the loop."""
        try:
            self._future.set_result(self._work())
        except Exception as error:
            self._future.set_exception(error)

    def wait(self, given_up: Callable[[], bool]) -> ResultT:
        """Wait for the work; return its result, or raise its exception.

        Raises:
            Refusal: `unavailable`, if it was `given_up` because the planner ends.
        """
        while not wait([self._future], LOOK_S).done:
            if given_up():
                raise Refusal("unavailable", "the planner ends; nothing changed", service="planner")
        return self._future.result()


class WorkerThread:
    """A thread that runs submitted work in order, with its own `worker` process."""

    def __init__(self, worker: Worker, inbox: Inbox[Any], log: logging.Logger) -> None:
        self._worker = worker
        self._inbox = inbox
        self._log = log
        self._queue: SimpleQueue[Callable[[], object] | None] = SimpleQueue()
        self.closing = False
        # The kernel ends the worker with the thread that started it, so this thread must start it.
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def submit(self, work: Callable[[], object]) -> None:
        """Queue `work` for the thread.

        Raises:
            Refusal: `busy`, if the queue is full.
        """
        if self._queue.qsize() >= QUEUE_LENGTH:
            sentence = f"{QUEUE_LENGTH} requests wait for the {self._worker.role} process; send this one later"
            raise Refusal("busy", sentence, goal_id=None)
        self._queue.put(work)

    def in_loop(self, work: Callable[[], ResultT]) -> ResultT:
        """Run `work` in the planner's loop, wait for it, and return its result.

        Raises:
            Refusal: `unavailable`, if the planner ends; and all exceptions of the work.
        """
        call = LoopCall(work)
        while not self._inbox.offer(call) and not self.closing:
            time.sleep(0.01)
        return call.wait(lambda: self.closing)

    def close(self) -> None:
        """End the process and drop the queue."""
        self.closing = True
        self._queue.put(None)
        self._worker.kill()
        self._thread.join(CLOSING_S)

    def _run(self) -> None:
        while (work := self._queue.get()) is not None and not self.closing:
            try:
                work()
            except Exception:  # for example a closed session: later requests must be answered nevertheless
                self._log.exception("an answer of the %s process was lost", self._worker.role, extra={"goal_id": None})
        self._worker.close()
