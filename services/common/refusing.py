"""Turn exceptions during a request into refusals."""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from protocol.errors import Refusal

if TYPE_CHECKING:
    from protocol.bus.bus import PendingQuery  # the planner's workers need no Zenoh

OWN_ERROR = "the {service} met an error of its own; please report what its log says"


@contextmanager
def refusing(
    asking: "PendingQuery",
    service: str,
    log: logging.Logger,
    goal_id: str | None = None,
    then: Callable[[Refusal], object] = lambda _: None,
) -> Iterator[None]:
    """Reply to `asking` with the refusal that the block raises, log it, and call `then` with it.

    An unexpected error becomes the refusal `unavailable`, so that the service continues with other requests.
    """
    try:
        yield
        return
    except Refusal as reason:
        refusal = reason
    except Exception:
        log.exception("%s met an error of the %s", asking.topic.key, service, extra={"goal_id": goal_id})
        detail = {"service": service} | ({"goal_id": goal_id} if goal_id else {})
        refusal = Refusal("unavailable", OWN_ERROR.format(service=service), **detail)
    asking.refuse(refusal)
    fields = {"goal_id": goal_id, "code": refusal.code}
    log.info("%s refused as %s: %s", asking.topic.key, refusal.code, refusal, extra=fields)
    then(refusal)
