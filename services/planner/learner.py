"""Learning outside the planner's loop: the worker fits, its thread writes the file, the loop adds the primitive."""

import logging
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import msgspec

from motion.plan import prepare
from protocol import messages as m
from protocol.bus.pending_query import PendingQuery
from protocol.bus.queues import Inbox
from protocol.errors import Refusal
from services.common.refusing import refusing
from services.planner.learning import learned_message
from services.planner.library import Library, Written
from services.planner.worker_link import Worker
from services.planner.worker_thread import WorkerThread


class Head(msgspec.Struct):
    """The fields of a `learn` request that the planner's loop decodes; the rest of the body may be long.

    The worker refuses a missing name, with all other faults.
    """

    name: str | None = None
    replace: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class _Request:
    query: PendingQuery
    head: Head
    body: memoryview


class Learner:
    """Answers `learn` requests, one at a time, outside the planner's loop.

    `keep` adds a written primitive to the library; it is called in the loop, through `inbox`, and may refuse.
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
        self._log = log
        self._worker_thread = WorkerThread(worker, inbox, log)
        self._worker_thread.submit(self._prepare)

    def submit(self, query: PendingQuery, head: Head, body: memoryview) -> None:
        """Queue a request, to learn and reply after the earlier ones.

        Raises:
            Refusal: `busy`, if the queue is full.
        """
        self._worker_thread.submit(lambda: self._answer(_Request(query, head, body)))

    def close(self) -> None:
        """End the worker and drop the queue."""
        self._worker_thread.close()

    def _prepare(self) -> None:
        for entry in list(self._library):
            with suppress(Refusal):  # it was removed meanwhile
                if not self._worker_thread.closing:
                    prepare(self._library.get(entry.name))

    def _answer(self, request: _Request) -> None:
        with refusing(request.query, "planner", self._log):
            request.query.reply(self._learn(request))

    def _learn(self, request: _Request) -> m.Learned:
        learned, name = self._worker.learn(request.body), request.head.name
        assert name is not None
        prepare(learned.primitive)
        written = self._library.write(name, learned.primitive)
        try:
            self._worker_thread.in_loop(lambda: self._keep(written, request.head.replace))
        except Refusal:
            written.temporary.unlink(missing_ok=True)
            raise
        self._library.sync()
        shape = name, learned.primitive.duration, learned.primitive.joint_count, learned.primitive.basis_count
        self._log.info("learned %s: %.3f s, %d joints, %d functions each", *shape)
        for sentence in learned.warnings:
            self._log.warning("%s: %s", name, sentence)
        return learned_message(name, learned.primitive, learned.warnings)
