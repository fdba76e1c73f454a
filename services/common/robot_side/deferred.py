"""A reply that is deferred to a later tick."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from protocol.bus.pending_query import PendingQuery
from protocol.errors import Refusal


@dataclass(slots=True)
class DeferredReply:
    """The reply to a request that takes several ticks.

    Attributes:
        query: The request.
        is_due: Returns whether the request can be answered now.
        reply: Makes the reply.
        deadline: Monotonic time, s, after which the request is answered in any case.
        refuse: Makes the refusal that is sent after the deadline; None: send the reply.
    """

    query: PendingQuery
    is_due: Callable[[], bool]
    reply: Callable[[], Any]
    deadline: float
    refuse: Callable[[], Refusal] | None = None

    def settle(self) -> bool:
        """Answer the request if it is due or its deadline has passed, and return whether it was answered."""
        due = self.is_due()
        if not due and time.monotonic() <= self.deadline:
            return False
        if not due and self.refuse is not None:
            self.query.refuse(self.refuse())
        else:
            self.query.reply(self.reply())
        return True
