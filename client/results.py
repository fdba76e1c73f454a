"""Results of goals, as the controller publishes them."""

import contextlib
import math
import threading
import time
from collections import OrderedDict, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager

from client.link import Link
from client.mailboxes import Mailbox
from protocol import messages as m
from protocol.codec import decode
from protocol.errors import Refusal
from protocol.topics import ENDED, RESULT

ASK_EVERY_S = 1.0
"""Period with which a waiting client requests the result, in case the publication was lost."""
KEPT = 256
"""Number of results kept for handles that have not waited yet."""


class Results:
    """Results of a robot's goals: received as published, otherwise requested."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._lock = threading.Lock()
        self._ended: OrderedDict[str, m.Result] = OrderedDict()
        self._mailboxes: defaultdict[str, list[Mailbox[m.Result]]] = defaultdict(list)
        self._listens = False

    def expect(self, goal_id: str | None) -> None:
        """Subscribe before a goal is sent; drop the result of an earlier goal with the same id."""
        with self._lock:
            if not self._listens:
                self._link.subscribe(ENDED, self._hear)
                self._listens = True
            if goal_id is not None:
                self._ended.pop(goal_id, None)

    async def wait(self, goal_id: str, timeout: float | None) -> m.Result:
        """Return the result of a goal once it has ended.

        Raises:
            TimeoutError: the goal has not ended within `timeout` s.
            Refusal: `unknown_goal`, if the controller does not know the goal.
            NoAnswer: no result was published, and the controller does not reply.
        """
        end = math.inf if timeout is None else time.monotonic() + timeout
        with self._mailbox(goal_id) as box:
            while True:
                with contextlib.suppress(TimeoutError):
                    return await box.take(max(0.0, min(ASK_EVERY_S, end - time.monotonic())))
                result = await self._link.ask(RESULT, m.ResultRequest(goal_id=goal_id))
                if result.outcome != "running":
                    return result
                if time.monotonic() >= end:
                    raise TimeoutError(f"goal {goal_id} still runs after {timeout:g} s")

    @contextmanager
    def _mailbox(self, goal_id: str) -> Iterator[Mailbox[m.Result]]:
        """Return the mailbox of a goal's result, which may have arrived already."""
        box: Mailbox[m.Result] = self._link.mailbox(1)
        with self._lock:
            self._mailboxes[goal_id].append(box)
            if goal_id in self._ended:
                box.put(self._ended[goal_id])
        try:
            yield box
        finally:
            with self._lock:
                self._mailboxes[goal_id].remove(box)
                if not self._mailboxes[goal_id]:
                    del self._mailboxes[goal_id]

    def _hear(self, body: bytes) -> None:
        """Store a publication, in Zenoh's thread."""
        with contextlib.suppress(Refusal):  # a message that cannot be decoded counts as lost
            result = decode(body, ENDED.message)
            with self._lock:
                self._ended[result.goal_id] = result
                if len(self._ended) > KEPT:
                    self._ended.popitem(last=False)
                for box in self._mailboxes.get(result.goal_id, ()):
                    box.put(result)
