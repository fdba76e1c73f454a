"""A request that a service has received and not yet answered."""

import time
from typing import Generic

import zenoh

from protocol import messages as m
from protocol.codec import ENCODING, check_request_size, decode, encode
from protocol.errors import Refusal
from protocol.topics import Query, ReplyT, RequestT


class PendingQuery(Generic[RequestT, ReplyT]):
    """A request that awaits its one answer by `reply` or `refuse`. `arrival_ns`: Unix time."""

    def __init__(self, topic: Query[RequestT, ReplyT], key: str, query: zenoh.Query) -> None:
        self.topic = topic
        self.arrival_ns = time.time_ns()
        self._key = key
        self._query = query

    def decode(self) -> RequestT:
        """Return the request.

        Raises:
            Refusal: `bad_message`: the payload is malformed or too large.
        """
        payload = self._query.payload
        if not payload:
            return decode(b"\x80", self.topic.request)
        check_request_size(self.topic, len(payload))  # before the copy, which would delay a loop
        return decode(payload.to_bytes(), self.topic.request, self.topic.max_bytes)

    def reply(self, answer: ReplyT) -> None:
        """Answer the request."""
        with self._query as query:
            query.reply(self._key, encode(answer), encoding=ENCODING)

    def refuse(self, refusal: Refusal) -> None:
        """Answer with `reply_err`."""
        body = m.ErrorBody(code=refusal.code, message=refusal.message, detail=refusal.detail)
        with self._query as query:
            query.reply_err(encode(body), encoding=ENCODING)
