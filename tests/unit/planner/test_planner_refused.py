"""Goals are answered before their plan or refusal is published."""

import logging
import threading
from collections.abc import Callable
from typing import Any

import msgspec
import pytest

from protocol import messages as m
from protocol import topics
from protocol.bus.pending_query import PendingQuery
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


class FakeRequest:
    """A request that records its answer in `events`."""

    def __init__(self, topic: topics.Query, body: bytes, events: list[Any]) -> None:
        self.topic = topic
        self.arrival_ns = ARRIVED_NS
        self._body = body
        self.reply = self.refuse = events.append

    def decode(self) -> Any:
        """Return the request."""
        return decode(self._body, self.topic.request)


class FakeBus:
    """A bus with queued `requests`; `events` has the planner's answers and publications in order.

    Stands in for the controller, too: its reference is `origin`, and it executes plans only if `accepts`.
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
        """Queue all requests, including those of other topics."""
        if topic is topics.GOAL:
            for each, body in self.requests:
                inbox.offer(FakeRequest(each, body, self.events))  # type: ignore[arg-type]

    def publisher(self, topic: topics.Publication, blocking: bool = False) -> "FakeBus":
        """Check that only plans are published blocking; a blocked refusal would delay the next answer."""
        assert blocking is (topic is topics.PLAN)
        return self

    def send(self, topic: topics.Query, asked: Any) -> Callable[[], Any]:
        """Return a function that returns the answer."""
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
        """No requests are sent as publications."""
        return []

    def listen(self, *_: object) -> None:
        """Do nothing."""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """A library with the shipped forehand."""
    library = Library(tmp_path_factory.mktemp("library"), ARM, LOG)
    forehand = learn_from_csv(DEMONSTRATIONS / "forehand.csv", ROBOT.joint_names)
    assert forehand is not None
    library.put("forehand", forehand)
    return library


def answered(library: Library, bus: FakeBus, lead: LeadTime | None = None) -> list[Any]:
    """Run the planner's loop for all requests of `bus`, and return its events."""

    class Stopping(threading.Event):
        """Set after one turn of the loop for each request."""

        def is_set(self) -> bool:
            """Count a turn; all requests are queued, so each turn takes one."""
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
def test_a_refusal_is_published_after_the_answer(library: Library, code: str, changes: dict[str, Any]):
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
    assert refused.goal_id, "a goal without an id gets one"


def test_a_plan_is_published_after_the_answer(library: Library):
    """So a subscriber with a dead link does not delay the answer; a repeated goal is played once."""
    requests = [(topics.GOAL, encode(GOAL))] * 2
    reply, played, again = answered(library, FakeBus(requests, accepts=True))
    assert (type(reply), type(played)) == (m.GoalReply, m.Plan)
    assert (reply.goal_id, played.goal_id) == ("g1", "g1")
    assert again == reply


def test_a_motion_that_is_too_long_with_its_stop_is_refused_with_its_duration(library: Library):
    """The controller's own refusal would name a number of samples, which is not part of the goal."""
    goal = msgspec.structs.replace(GOAL, duration=59.999, velocities=[1.0] * ROBOT.joint_count)
    refusal, _ = answered(library, FakeBus([(topics.GOAL, encode(goal))], accepts=True))
    assert (refusal.code, refusal.detail["field"]) == ("invalid_goal", "duration")
    assert "59.999 s and its stop 0.0" in refusal.message


def test_a_plan_that_is_too_large_for_execute_is_not_reported_as_bad_message(library: Library):
    """The goal's own body has only some 200 bytes."""

    class Strict(FakeBus):
        def ask(self, topic: topics.Query, asked: m.Message) -> m.Reference | m.Accepted:
            if topic is topics.EXECUTE:
                raise bad_message("", "`execute` takes at most 4 bytes, and this body has 5")
            return super().ask(topic, asked)

    refusal, refused = answered(library, Strict([(topics.GOAL, encode(GOAL))]))
    assert (refusal.code, refusal.detail["field"], refused.code) == ("invalid_goal", "duration", "invalid_goal")
    assert refusal.message == "the plan cannot be executed: `execute` takes at most 4 bytes, and this body has 5"


def test_a_correction_without_time_left_is_checked_for_collisions_to_its_end(library: Library):
    """6 s ahead its racket would hit the floor, so the motion that it corrects continues."""

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


def test_a_goal_without_an_answer_of_the_controller_is_refused_as_unavailable(library: Library):
    refusal, refused = answered(library, FakeBus([(topics.GOAL, encode(GOAL))], origin=None))
    assert (refusal.code, refused.code, refused.goal_id) == ("unavailable", "unavailable", "g1")


@pytest.mark.parametrize(("silent", "count"), [(True, 0), (False, 1)])
def test_a_controller_that_does_not_answer_does_not_lengthen_later_leads(library: Library, silent: bool, count: int):
    """Its timeout is no planning time; a refusal ends one."""
    notes: list[float] = []

    class Bus(FakeBus):
        def ask(self, topic: topics.Query, asked: m.Message) -> m.Reference | m.Accepted:
            if silent and topic is topics.EXECUTE:
                raise NoAnswer(topic.owner, topic.key)
            return super().ask(topic, asked)

    class Lead(LeadTime):
        def note(self, seconds: float, kind: str = "qp", late: bool = False) -> None:
            notes.append(seconds)

    answered(library, Bus([(topics.GOAL, encode(GOAL))]), Lead(ROBOT.tick))
    assert len(notes) == count


@pytest.mark.parametrize("body", [b"", b"{", encode(m.Forget(name="forehand"))])
def test_the_published_refusal_of_a_malformed_goal_has_no_fields_of_a_goal(library: Library, body: bytes):
    """In particular none of the previous goal."""
    first, second = (topics.GOAL, encode(GOAL)), (topics.GOAL, body)
    *_, refusal, refused = answered(library, FakeBus([first, second]))
    assert (refusal.code, refused.code, refused.message) == ("bad_message", "bad_message", refusal.message)
    assert (refused.goal_id, refused.client_id, refused.primitive) == (None, "", "")


def test_refusals_of_other_requests_and_plans_not_executed_are_not_published(library: Library):
    plan_only = msgspec.structs.replace(GOAL, plan_only=True)
    requests = [(topics.FORGET, encode(m.Forget(name="backhand"))), (topics.GOAL, encode(plan_only))]
    refusal, reply = answered(library, FakeBus(requests))
    assert (refusal.code, type(reply)) == ("unknown_primitive", m.GoalReply)
