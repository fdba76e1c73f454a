"""Turn exceptions during a request into refusals."""

import logging
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from protocol.errors import Refusal

if TYPE_CHECKING:
    from protocol.bus.pending_query import PendingQuery  # the planner's workers need no Zenoh

OWN_ERROR = "the {service} met an error of its own; please report what its log says"

OWN_ID = frozenset({"late", "unavailable"})
"""Codes whose detail has the id of the refused goal itself."""

_ENTRY = re.compile(
    r"(?:(?:start|(?P<limits>limits)|(?:waypoints|alternatives)\[\d+\])\.)?"
    r"(?:positions|velocities|accelerations|jerks)\[(?P<first>\d+)\](?:\[(?P<second>\d+)\])?(?=: | is )"
)
"""Path of a joint's value at the begin of a sentence: the joint is the index, of a range of positions the first of two
indices, and of a sample the second."""


@contextmanager
def refusing(
    query: "PendingQuery",
    service: str,
    log: logging.Logger,
    goal_id: str | None = None,
    then: Callable[[Refusal], object] = lambda _: None,
    joints: Sequence[str] = (),
) -> Iterator[None]:
    """Reply to `query` with the refusal that the block raises, log it, and call `then` with it.

    An unexpected error becomes the refusal `unavailable`, so that the service continues with other requests. goal_id:
    of the refused goal, for refusals that lack it. joints: names for the values of joints that a refusal gives by their
    index.
    """

    def refuse(refusal: Refusal) -> None:
        query.refuse(refusal)
        fields = {"goal_id": goal_id, "code": refusal.code}
        log.info("%s refused as %s: %s", query.topic.key, refusal.code, refusal, extra=fields)
        then(refusal)

    # No variable of this frame keeps the caught error: its traceback refers to the frame, and a service that does not
    # collect cycles would keep the request for ever.
    try:
        yield
    except Refusal as reason:
        refuse(with_goal(with_joint(reason, joints), goal_id))
    except Exception:
        log.exception("%s met an error of the %s", query.topic.key, service, extra={"goal_id": goal_id})
        refuse(with_goal(Refusal("unavailable", OWN_ERROR.format(service=service), service=service), goal_id))


def with_goal(refusal: Refusal, goal_id: str | None) -> Refusal:
    """Return a refusal of a goal with the goal's id in its detail, if its code has one and it is missing."""
    if goal_id is None or refusal.code not in OWN_ID or refusal.detail.get("goal_id") is not None:
        return refusal
    return Refusal(refusal.code, refusal.message, **{**refusal.detail, "goal_id": goal_id})


def with_joint(refusal: Refusal, names: Sequence[str]) -> Refusal:
    """Return a refusal whose sentence begins with the path of a joint's value with the name of the joint after it.

    For example `positions[0] (joint shoulder) is nan`. The detail stays the same.
    """
    path = _ENTRY.match(refusal.message)
    if path is None:
        return refusal
    joint = int(path["second"] if path["second"] and not path["limits"] else path["first"])
    if joint >= len(names):
        return refusal
    sentence = f"{path[0]} (joint {names[joint]}){refusal.message[path.end() :]}"
    return Refusal(refusal.code, sentence, **refusal.detail)
