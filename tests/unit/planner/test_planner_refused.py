"""A goal is answered before it is published, also one that is refused, for whatever reason."""

import logging
import threading
from collections.abc import Callable
from typing import Any

import msgspec
import pytest

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import PendingQuery
from protocol.bus.queues import Inbox
from protocol.codec import bad_message, decode, encode
from protocol.errors import NoAnswer, Refusal
from robot.description import load_robot
from robot.shipped import DEMONSTRATIONS
from services.planner.core import Planner
from services.planner.lead_time import LeadTime
from services.planner.learning import learn_from_csv
from services.planner.library import Arm, Library
from services.planner.loop import Loop

ROBOT = load_robot()
ARM = Arm(ROBOT.name, ROBOT.joint_names)
LOG = logging.getLogger("planner")
HOME, STILL = ROBOT.home.tolist(), [0.0] * ROBOT.joint_count
ARRIVED_NS = 1_760_000_000_123_456_789
GOAL = m.Goal(primitive="forehand", positions=HOME, goal_id="g1", client_id="shell-1")
REFERENCE = m.Reference(time=4.5, epoch=3, positions=HOME, velocities=STILL, accelerations=STILL)


class RequestT:
    """A request whose answer goes into `events`."""

    def __init__(self, topic: topics.Query, body: bytes, events: list[Any]) -> None:
        self.topic = topic
        self.arrival_ns = ARRIVED_NS
        self._body = body
        self.reply = self.refuse = events.append

    def decode(self) -> Any:
        """Return the request."""
        return decode(self._body, self.topic.request)


class FakeBus:
    """A bus that brings the planner `requests`; `events` are what it answers and publishes, in order.

    The controller's reference is `origin`, and unless it `accepts` it refuses whatever it shall execute.
    """

    def __init__(
        self,
        requests: list[tuple[topics.Query, bytes]],
        origin: m.Reference | None = REFERENCE,
        accepts: bool = False,
    ) -> None:
        self.events: list[Any] = []
        self.put = self.events.append
        self.requests = requests
        self._origin = origin
        self._accepts = accepts

    def serve(self, topic: topics.Query, inbox: Inbox[PendingQuery]) -> None:
        """Bring all requests at once, those of other topics too."""
        if topic is topics.GOAL:
            for each, body in self.requests:
                inbox.offer(RequestT(each, body, self.events))  # type: ignore[arg-type]

    def publisher(self, topic: topics.Publication, blocking: bool = False) -> "FakeBus":
        """Check that only a plan waits for a listener with a dead link; a refusal would delay the next answer."""
        assert blocking is (topic is topics.PLAN)
        return self

    def send(self, topic: topics.Query, asked: Any) -> Callable[[], Any]:
        """Answer when the answer is awaited."""
        return lambda: self.ask(topic, asked)

    def ask(self, topic: topics.Query, asked: m.Message) -> m.Reference | m.Accepted:
        """Answer as the controller."""
        if self._origin is None:
            raise NoAnswer(topic.owner, topic.key)
        if isinstance(asked, m.Trajectory) and self._accepts:
            return m.Accepted(goal_id=asked.goal_id, start_time=asked.start_time)
        if topic is topics.EXECUTE:
            raise Refusal("busy", "a motion runs", goal_id="g0")
        return self._origin

    def announce(self, _: str) -> None:
        """Do nothing."""

    def watch_alive(self, *_: object) -> None:
        """Do nothing."""

    def take_puts(self) -> list[str]:
        """Nobody puts a request."""
        return []

    def listen(self, *_: object) -> None:
        """Do nothing."""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """A library that knows the forehand."""
    library = Library(tmp_path_factory.mktemp("library"), ARM, LOG)
    forehand = learn_from_csv(DEMONSTRATIONS / "forehand.csv", ROBOT.joint_names)
    assert forehand is not None
    library.put("forehand", forehand)
    return library


def answered(library: Library, bus: FakeBus, lead: LeadTime | None = None) -> list[Any]:
    """Let the planner answer all that `bus` brings, and return what it says, in order."""

    class Stopping(threading.Event):
        """Set once every request had its turn."""

        def is_set(self) -> bool:
            """The requests wait from the start, so each turn takes one."""
            turns.pop()
            return not turns

    turns = [None] * (len(bus.requests) + 1)
    lead = lead or LeadTime(ROBOT.tick)
    planner = Planner(bus, ROBOT, library, lead, LOG)  # type: ignore[arg-type]
    Loop(bus, planner, library, ROBOT, lead, LOG).serve(Stopping())  # type: ignore[arg-type]
    return bus.events


def test_a_value_given_by_its_index_is_followed_by_its_joint(library: Library):
    """In the reply and in the publication."""
    goal = msgspec.structs.replace(GOAL, positions=[*HOME[:-1], float("nan")])
    refusal, refused = answered(library, FakeBus([(topics.GOAL, encode(goal))]))
    last = ROBOT.joint_count - 1
    assert refusal.message == f"positions[{last}] (joint {ROBOT.joint_names[-1]}) is nan; it must be finite"
    assert refusal.detail == {"field": f"positions[{last}]"}
    assert (refused.message, refused.detail) == (refusal.message, refusal.detail)


@pytest.mark.parametrize(
    ("code", "changes"),
    [
        ("unknown_primitive", {"primitive": "backhand"}),
        ("invalid_goal", {"duration": -1.0}),
        ("bad_message", {"positions": HOME[:-1]}),
        ("late", {"arrival_time": 4.5}),
        ("limit", {"positions": [9.0, *HOME[1:]]}),
        ("infeasible", {"positions": [1.5, *HOME[1:]], "duration": 0.05}),
        ("invalid_goal", {"duration": 59.999, "velocities": [1.0] * ROBOT.joint_count}),
        ("busy", {"goal_id": None}),
    ],
)
def test_it_is_published_after_the_answer(library: Library, code: str, changes: dict[str, Any]):
    goal = msgspec.structs.replace(GOAL, **changes)
    refusal, refused = answered(library, FakeBus([(topics.GOAL, encode(goal))]))
    assert refusal.code == code
    assert refused == m.Refused(
        goal_id=goal.goal_id or refused.goal_id,
        client_id="shell-1",
        primitive=goal.primitive,
        code=code,
        message=refusal.message,
        detail=refusal.detail,
        requested=ARRIVED_NS,
    )
    assert refused.goal_id, "a goal without an id is given one"


def test_what_is_played_is_published_after_the_answer(library: Library):
    """A listener with a dead link does not delay the answer; a repeated goal is played once."""
    requests = [(topics.GOAL, encode(GOAL))] * 2
    reply, played, again = answered(library, FakeBus(requests, accepts=True))
    assert (type(reply), type(played)) == (m.GoalReply, m.Plan)
    assert (reply.goal_id, played.goal_id) == ("g1", "g1")
    assert again == reply


def test_a_motion_too_long_with_its_stop_names_what_made_it_so(library: Library):
    """Before the controller would refuse a number of samples, of which no goal speaks."""
    goal = msgspec.structs.replace(GOAL, duration=59.999, velocities=[1.0] * ROBOT.joint_count)
    refusal, _ = answered(library, FakeBus([(topics.GOAL, encode(goal))], accepts=True))
    assert (refusal.code, refusal.detail["field"]) == ("invalid_goal", "duration")
    assert "59.999 s and its stop 0.0" in refusal.message


def test_a_plan_that_execute_does_not_take_is_no_fault_of_the_body(library: Library):
    """A client that sent 200 bytes is not told that its body is too large."""

    class Strict(FakeBus):
        def ask(self, topic: topics.Query, asked: m.Message) -> m.Reference | m.Accepted:
            if topic is topics.EXECUTE:
                raise bad_message("", "`execute` takes at most 4 bytes, and this body has 5")
            return super().ask(topic, asked)

    refusal, refused = answered(library, Strict([(topics.GOAL, encode(GOAL))]))
    assert (refusal.code, refusal.detail["field"], refused.code) == ("invalid_goal", "duration", "invalid_goal")
    assert refusal.message == "the plan cannot be executed: `execute` takes at most 4 bytes, and this body has 5"


def test_a_correction_that_has_no_time_left_is_checked_to_its_end(library: Library):
    """Its racket would go into the floor, 6 s ahead: the motion that it corrects goes on."""

    class Moving(FakeBus):
        def ask(self, topic: topics.Query, asked: m.Message) -> m.Reference | m.Accepted:
            if topic is topics.REFERENCE and any(isinstance(event, m.GoalReply) for event in self.events):
                return msgspec.structs.replace(REFERENCE, time=5.0, goal_id="g1")
            return super().ask(topic, asked)

    first = msgspec.structs.replace(GOAL, duration=6.5)
    low = [HOME[0], HOME[1] + 1.2, *HOME[2:]]
    second = msgspec.structs.replace(first, duration=6.0, positions=low, goal_id="g2", revises="g1")
    bus = Moving([(topics.GOAL, encode(first)), (topics.GOAL, encode(second))], accepts=True)
    *_, refusal, refused = answered(library, bus, LeadTime(ROBOT.tick, fixed=0.0))
    assert (refused.goal_id, refusal.code) == ("g2", "collision")
    assert {refusal.detail["body"], refusal.detail["other"]} == {"racket", "floor"}


def test_a_controller_that_is_silent(library: Library):
    refusal, refused = answered(library, FakeBus([(topics.GOAL, encode(GOAL))], origin=None))
    assert (refusal.code, refused.code, refused.goal_id) == ("unavailable", "unavailable", "g1")


@pytest.mark.parametrize("body", [b"", b"{", encode(m.Forget(name="forehand"))])
def test_of_what_does_not_decode_only_the_refusal_is_known(library: Library, body: bytes):
    """The published refusal contains nothing of the request before it."""
    first, second = (topics.GOAL, encode(GOAL)), (topics.GOAL, body)
    *_, refusal, refused = answered(library, FakeBus([first, second]))
    assert (refusal.code, refused.code, refused.message) == ("bad_message", "bad_message", refusal.message)
    assert (refused.goal_id, refused.client_id, refused.primitive) == (None, "", "")


def test_nothing_else_is_published(library: Library):
    """Neither other requests that are refused nor goals that are not."""
    plan_only = msgspec.structs.replace(GOAL, plan_only=True)
    requests = [(topics.FORGET, encode(m.Forget(name="backhand"))), (topics.GOAL, encode(plan_only))]
    refusal, reply = answered(library, FakeBus(requests))
    assert (refusal.code, type(reply)) == ("unknown_primitive", m.GoalReply)
