"""The planner's log of goals and refusals: level, goal id and code as fields."""

import logging
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from msgspec import structs

from motion.plan import Plan, plan
from protocol import messages as m
from protocol import topics
from protocol.codec import encode
from protocol.errors import Refusal
from robot.description import load_robot
from services.planner.__main__ import learn_shipped
from services.planner.core import Planner
from services.planner.lead_time import LeadTime
from services.planner.library import Arm, Library
from services.planner.loop import Loop
from tests.closed_loop import ClosedLoop

ROBOT = load_robot()
ARM = Arm(ROBOT.name, ROBOT.joint_names)
LOG = logging.getLogger("planner")
GOAL = m.Goal(primitive="forehand", positions=ROBOT.home.tolist(), duration=0.5)


class FakeBus:
    """A bus and a controller at rest that refuses the first `late` trajectories as late and records all goal ids."""

    def __init__(self, late: int = 0) -> None:
        self.late = late
        self.goal_ids: list[str] = []
        self.on_reference: Callable[[], object] = lambda: None

    def publisher(self, *_: object, **__: object) -> SimpleNamespace:
        """Return a publisher that discards messages."""
        return SimpleNamespace(put=lambda _: None)

    def send(self, topic: topics.Query, asked: Any) -> Callable[[], Any]:
        """Return a function that returns the answer."""
        return lambda: self.ask(topic, asked)

    def ask(self, topic: topics.Query, request: Any) -> object:
        """Answer as a controller at rest."""
        if topic is topics.REFERENCE:
            self.on_reference()
            rest = [0.0] * ROBOT.joint_count
            return m.Reference(time=1.0, positions=ROBOT.home.tolist(), velocities=rest, accelerations=rest, epoch=0)
        self.goal_ids.append(request.goal_id)
        if len(self.goal_ids) <= self.late:
            raise Refusal("late", f"goal {request.goal_id} starts too late", goal_id=request.goal_id)
        return m.Accepted(goal_id=request.goal_id, start_time=1.0)


class FakeRequest:
    """A request that records its answers."""

    def __init__(self, topic: topics.Query, request: object) -> None:
        self.topic, self._request = topic, request
        self.arrival_ns = 1
        self.answers: list[Any] = []

    def decode(self) -> object:
        """Return the request, or raise it if it is a refusal."""
        if isinstance(self._request, Refusal):
            raise self._request
        if isinstance(self._request, m.Learn):
            return msgspec.Raw(encode(self._request))
        return self._request

    def reply(self, reply: object) -> None:
        """Record an answer."""
        self.answers.append(reply)

    refuse = reply


class PlannerHarness:
    """A planner with the shipped library that answers one request at a time."""

    def __init__(self, folder: Path, caplog: pytest.LogCaptureFixture) -> None:
        self.bus = FakeBus()
        library = Library(folder / "library", ARM, LOG)
        learn_shipped(library, ROBOT, LOG)
        self.lead = LeadTime(ROBOT.tick)
        self.planner = Planner(self.bus, ROBOT, library, self.lead, LOG)  # type: ignore[arg-type]
        self.loop = Loop(self.bus, self.planner, library, ROBOT, self.lead, LOG)  # type: ignore[arg-type]
        caplog.set_level(logging.INFO)
        self._caplog = caplog

    def ask(self, topic: topics.Query, request: object) -> tuple[Any, list[tuple[str, str | None, str | None]]]:
        """Return the answer, and level, goal id and code of each line logged meanwhile."""
        self._caplog.clear()
        asked = FakeRequest(topic, request)
        self.loop.answer(asked)  # type: ignore[arg-type]
        while not asked.answers:  # demonstrations are learned in another thread
            self.loop.do(self.loop.inbox.take(0.1))
        (given,) = asked.answers
        lines = [
            (each.levelname, each.__dict__.get("goal_id"), each.__dict__.get("code")) for each in self._caplog.records
        ]
        return given, lines


@pytest.fixture
def harness(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> Iterator[PlannerHarness]:
    """A planner with a controller at rest."""
    harness = PlannerHarness(tmp_path, caplog)
    yield harness
    harness.loop.close()


def test_a_played_goal_is_logged_with_its_id(harness: PlannerHarness):
    reply, lines = harness.ask(topics.GOAL, GOAL)
    assert lines == [("INFO", reply.goal_id, None)]
    assert harness.bus.goal_ids == [reply.goal_id]


def test_a_goal_that_was_late_once_is_logged_as_warning(harness: PlannerHarness):
    harness.bus.late = 1
    reply, lines = harness.ask(topics.GOAL, GOAL)
    assert lines == [("WARNING", reply.goal_id, "late"), ("INFO", reply.goal_id, None)]


def test_planning_time_is_noted_in_robot_time(harness: PlannerHarness, monkeypatch: pytest.MonkeyPatch):
    """Robot time passes at a tenth of wall-clock time here."""
    wall, noted = [100.0], list[float]()
    monkeypatch.setattr(time, "monotonic", lambda: wall[0])
    monkeypatch.setattr(harness.lead, "note", lambda seconds, *_: noted.append(seconds))
    status = ClosedLoop(ROBOT).controller.status()
    for time_s in (1.0, 1.02):
        wall[0] += 0.2
        harness.planner.receive_status(msgspec.structs.replace(status, time=time_s))
    accept = harness.bus.ask

    def ask(topic: topics.Query, request: Any) -> object:
        wall[0] += 0.5 if topic is topics.EXECUTE else 0.0
        return accept(topic, request)

    monkeypatch.setattr(harness.bus, "ask", ask)
    harness.ask(topics.GOAL, GOAL)
    assert noted == [pytest.approx(0.05)]


def test_a_goal_without_an_id_is_logged_with_its_assigned_one(harness: PlannerHarness):
    harness.bus.late = 2
    refusal, lines = harness.ask(topics.GOAL, GOAL)
    goal_id = refusal.detail["goal_id"]
    assert harness.bus.goal_ids == [goal_id] * 2
    assert lines == [("WARNING", goal_id, "late"), ("INFO", goal_id, "late")]


@pytest.mark.parametrize(("sent", "shown"), [("g-1", "g-1"), ("g" * 5000, "g" * 128)])
def test_a_refused_goal_is_logged_with_its_id(harness: PlannerHarness, sent: str, shown: str):
    """Long ids are shortened to 128 characters."""
    goal = m.Goal(primitive="forehand", positions=GOAL.positions, goal_id=sent, duration=-1.0)
    refusal, lines = harness.ask(topics.GOAL, goal)
    assert lines == [("INFO", shown, refusal.code)]
    assert refusal.code == "invalid_goal"


def test_refusals_of_other_or_malformed_requests_are_logged_without_an_id(
    harness: PlannerHarness, caplog: pytest.LogCaptureFixture
):
    for topic, request, code in (
        (topics.FORGET, m.Forget(name="none"), "unknown_primitive"),
        (topics.LEARN, m.Learn(name="-", positions=[]), "bad_message"),
        (topics.LEARN, m.Learn(name="new", positions=[]), "bad_message"),
        (topics.LEARN, m.Learn(name="forehand", positions=[]), "exists"),
        (topics.GOAL, Refusal("bad_message", "no map", field=""), "bad_message"),
    ):
        refusal, lines = harness.ask(topic, request)
        assert refusal.code == code
        assert lines == [("INFO", None, code)]
        assert caplog.messages[-1] == f"{topic.key} refused as {code}: {refusal}"


@pytest.mark.parametrize(
    ("change", "order"),
    [
        ({}, ["plan", "reference"]),
        ({"arrival_time": 2.0}, ["reference", "plan"]),
        ({"start": None}, ["reference", "plan"]),
    ],
)
def test_a_goal_with_its_own_start_is_planned_while_the_reference_is_requested(
    harness: PlannerHarness, monkeypatch: pytest.MonkeyPatch, change: dict[str, Any], order: list[str]
):
    """Unless its duration depends on the reference."""
    events: list[str] = []

    def noted(*arguments: Any) -> Plan:
        events.append("plan")
        return plan(*arguments)

    monkeypatch.setattr("services.planner.solving.plan", noted)
    harness.bus.on_reference = lambda: events.append("reference")
    start = m.Start(positions=ROBOT.home.tolist(), velocities=[0.0] * 6)
    goal = m.Goal(primitive="forehand", positions=GOAL.positions, plan_only=True, start=start)
    reply, _ = harness.ask(topics.GOAL, structs.replace(goal, **change))
    assert events == order
    assert reply.start_time == 1.0


def test_an_unexpected_error_fails_only_its_request_and_is_logged(
    harness: PlannerHarness, monkeypatch: pytest.MonkeyPatch
):

    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    with monkeypatch.context() as patched:
        patched.setattr("services.planner.solving.plan", broken)
        refusal, lines = harness.ask(topics.GOAL, GOAL)
    goal_id = refusal.detail["goal_id"]
    assert (refusal.code, refusal.detail) == ("unavailable", {"service": "planner", "goal_id": goal_id})
    assert lines == [("ERROR", goal_id, None), ("INFO", goal_id, "unavailable")]
    reply, _ = harness.ask(topics.GOAL, GOAL)
    assert harness.bus.goal_ids == [reply.goal_id]


@pytest.mark.parametrize(
    ("change", "code", "field"),
    [
        ({"waypoints": [(2.0 * (k + 1) / 52, [0.0] * 6, None) for k in range(51)]}, "infeasible", None),
        ({"waypoints": [(2.0 * (k + 1) / 25, [0.0] * 6, [0.0] * 6) for k in range(24)]}, "infeasible", None),
        ({"method": "dmp", "limits": {"jerks": [1e-4] * 6}}, "invalid_goal", "duration"),
        ({"method": "dmp", "limits": {"jerks": [1e-8] * 6}}, "invalid_goal", "limits.jerks"),
    ],
)
def test_extreme_goals_are_refused(harness: PlannerHarness, change: dict[str, Any], code: str, field: str | None):
    """Regression: each of these once ended the planner or exhausted memory."""
    body = {"primitive": "forehand", "positions": GOAL.positions, "duration": 2.0, "plan_only": True, **change}
    body["waypoints"] = [
        {"time_from_start": time, "positions": positions, "velocities": velocities}
        for time, positions, velocities in body.get("waypoints", [])
    ]
    refusal, lines = harness.ask(topics.GOAL, msgspec.convert(body, m.Goal))
    assert (refusal.code, refusal.detail.get("field")) == (code, field)
    assert [level for level, _, _ in lines] == ["INFO"]


def test_a_goal_for_a_demonstration_over_60_s_needs_a_duration(harness: PlannerHarness):
    harness.ask(topics.LEARN, m.Learn(name="slow", positions=[ROBOT.home.tolist()] * 100, rate=1.0))
    for method in ("qp", "dmp"):
        goal = m.Goal(primitive="slow", positions=ROBOT.home.tolist(), method=method)
        refusal, _ = harness.ask(topics.GOAL, goal)
        assert (refusal.code, refusal.detail) == ("invalid_goal", {"field": "duration"})
        assert "give a duration of at most 60" in refusal.message


def test_every_request_has_a_reply_of_its_type(harness: PlannerHarness):
    for query in topics.QUERIES:
        if query.owner == "planner" and query is not topics.GOAL:
            request = {
                topics.LEARN: m.Learn(name="rest", positions=[ROBOT.home.tolist()] * 50, rate=100.0),
                topics.FORGET: m.Forget(name="forehand"),
            }.get(query, m.Empty())
            assert type(harness.ask(query, request)[0]) is query.reply
