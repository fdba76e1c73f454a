"""Replies to goals by goal_id: a goal that is sent twice gets the same reply and moves the arm once."""

from collections import OrderedDict
from hashlib import sha256

import msgspec

from protocol import messages as m
from protocol.errors import Refusal

KEPT = 1000
KEPT_BYTES = 64 << 20
"""Bound on the total size of the trajectories in stored replies."""


class ReplyCache:
    """The newest replies by goal_id, with a digest of each goal; the oldest are forgotten first."""

    def __init__(self, kept: int = KEPT, kept_bytes: int = KEPT_BYTES) -> None:
        self._kept = kept
        self._bytes_left = kept_bytes
        self._replies: OrderedDict[str, tuple[bytes, m.GoalReply]] = OrderedDict()

    def find(self, goal: m.Goal) -> m.GoalReply | None:
        """Return the stored reply to the same goal, or None.

        Raises:
            Refusal: `duplicate`, if the goal_id was used for another goal.
        """
        known = self._replies.get(goal.goal_id or "")
        if known is not None and known[0] != _digest(goal):
            sentence = f"goal_id {goal.goal_id!r} was used for another goal; make a new one"
            raise Refusal("duplicate", sentence, goal_id=goal.goal_id)
        return known and known[1]

    def keep(self, goal: m.Goal, reply: m.GoalReply) -> None:
        """Store the reply to `goal`."""
        self._replies[reply.goal_id] = _digest(goal), reply
        self._bytes_left -= _size(reply)
        while len(self._replies) > self._kept or self._bytes_left < 0:
            _, (_, forgotten) = self._replies.popitem(last=False)
            self._bytes_left += _size(forgotten)


def _digest(goal: m.Goal) -> bytes:
    return sha256(msgspec.msgpack.encode(goal)).digest()


def _size(reply: m.GoalReply) -> int:
    trajectory = reply.trajectory
    return 3 * len(trajectory.positions or b"") if trajectory else 0
