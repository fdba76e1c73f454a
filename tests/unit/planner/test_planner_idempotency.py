"""The cache of replies: a repeated goal gets the same reply, within bounds on number and bytes."""

import tracemalloc

import msgspec
import pytest

from protocol import messages as m
from protocol import topics
from protocol.codec import decode, encode
from protocol.errors import Refusal
from services.planner.idempotency import ReplyCache
from tests.golden.examples import EXAMPLES

GOAL = next(example for example in EXAMPLES.values() if isinstance(example, m.Goal))
REPLY = next(example for example in EXAMPLES.values() if isinstance(example, m.GoalReply))


def goal(goal_id: str) -> m.Goal:
    return msgspec.structs.replace(GOAL, goal_id=goal_id)


def reply(goal_id: str, trajectory_bytes: int = 0) -> m.GoalReply:
    assert REPLY.trajectory is not None
    trajectory = msgspec.structs.replace(REPLY.trajectory, positions=b"\0" * trajectory_bytes)
    return msgspec.structs.replace(REPLY, goal_id=goal_id, trajectory=trajectory if trajectory_bytes else None)


def test_a_repeated_goal_gets_the_same_reply():
    answers = ReplyCache()
    answers.keep(goal("a"), reply("a"))
    assert answers.find(goal("a")) == reply("a")
    assert answers.find(goal("b")) is None


def test_another_goal_with_the_same_id_is_refused_as_duplicate():
    answers = ReplyCache()
    answers.keep(goal("a"), reply("a"))
    with pytest.raises(Refusal, match="another goal") as caught:
        answers.find(msgspec.structs.replace(goal("a"), duration=9.0))
    assert caught.value.code == "duplicate"


def test_the_oldest_reply_is_evicted_first():
    answers = ReplyCache(kept=2)
    for name in "abc":
        answers.keep(goal(name), reply(name))
    assert [answers.find(goal(name)) is not None for name in "abc"] == [False, True, True]


def test_the_total_size_of_replies_is_bounded():
    answers = ReplyCache(kept_bytes=1000)
    for name in "abc":
        answers.keep(goal(name), reply(name, trajectory_bytes=160))
    assert [answers.find(goal(name)) is not None for name in "abc"] == [False, True, True]


def test_of_a_goal_only_a_digest_is_kept():
    """A goal with 256 alternatives takes 250 kB of memory, and a thousand goals are remembered."""
    answers, alternatives = ReplyCache(), [m.Alternative(positions=[0.5] * 6) for _ in range(m.MAX_ALTERNATIVES)]
    body = encode(msgspec.structs.replace(GOAL, alternatives=alternatives))
    tracemalloc.start()
    for number in range(20):
        answers.keep(decode(body, m.Goal, topics.GOAL.max_bytes), reply(str(number)))
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept < 20 * len(body)
