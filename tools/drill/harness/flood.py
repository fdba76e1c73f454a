"""Many requests at once from one session."""

import threading

import zenoh

from protocol import messages as m
from protocol import topics
from protocol.codec import ENCODING, decode
from protocol.errors import Refusal
from tools.drill.harness.cell import ACCEPTED

ANSWER_S = max(query.timeout_s for query in topics.QUERIES)
"""Timeout of every reply, s: the longest one of the contract, because the machine may be busy."""
NO_REPLY = "no reply"


class Flood:
    """Sends requests without waiting, at most `in_flight` unanswered.

    Attributes:
        codes: Code of each refusal, `accepted`, or `no reply` for a request that the owner did not answer.
        sent: Number of requests so far.
    """

    def __init__(self, session: zenoh.Session, key: str, in_flight: int = 16) -> None:
        self.codes: list[str] = []  # a Counter would lose some: each reply arrives in a thread of its own
        self.sent = 0
        self._session = session
        self._key = key
        self._in_flight = in_flight
        self._free = threading.Semaphore(in_flight)

    def send(self, body: bytes) -> None:
        """Send a request once fewer than `in_flight` are unanswered."""
        self._free.acquire()
        self.sent += 1
        handlers = zenoh.handlers.Callback(self.count, self._free.release)
        self._session.get(self._key, handlers, payload=body, encoding=ENCODING, timeout=ANSWER_S)

    def wait(self) -> None:
        """Wait for all outstanding replies."""
        for _ in range(self._in_flight):
            self._free.acquire(timeout=ANSWER_S)

    def count(self, reply: zenoh.Reply) -> None:
        """Count a reply, in Zenoh's thread."""
        if (code := code_in(reply)) is not None:
            self.codes.append(code)


def code_in(reply: zenoh.Reply) -> str | None:
    """Return the code of a refusal, `accepted`, `no reply` for Zenoh's own error, or None for an empty reply."""
    if reply.ok is not None:
        return ACCEPTED
    if reply.err is None:
        return None
    try:
        return decode(reply.err.payload.to_bytes(), m.ErrorBody).code
    except Refusal:  # plain text, for example Timeout
        return NO_REPLY
