"""Goals and demonstrations with bad fields are refused, and the services go on."""

import math

import pytest
from harness import ROBOT, Stack
from refusing import HOME, HUGE, JOINTS, refuse

from protocol import messages as m
from protocol import topics
from protocol.codec import matrix_bytes

pytestmark = pytest.mark.usefixtures("unharmed")

GOAL = {"primitive": "forehand", "positions": HOME}
NOT_A_NUMBER = [math.nan, *HOME[1:]]


@pytest.mark.parametrize(
    ("code", "field", "body"),
    [
        ("bad_message", "primitive", {"positions": HOME}),
        ("bad_message", "primitive", {**GOAL, "primitive": 7}),
        ("bad_message", "positions", {**GOAL, "positions": "home"}),
        ("bad_message", "positions[2]", {**GOAL, "positions": [0.0, 0.0, "x", 0.0, 0.0, 0.0]}),
        ("bad_message", "positions", {**GOAL, "positions": HOME[:5]}),
        ("bad_message", "positions[0]", {**GOAL, "positions": NOT_A_NUMBER}),
        ("bad_message", "velocities", {**GOAL, "velocities": [0.0] * 7}),
        ("bad_message", "velocities[5]", {**GOAL, "velocities": [0.0] * 5 + [math.inf]}),
        ("bad_message", "accelerations", {**GOAL, "accelerations": [None]}),
        ("bad_message", "duration", {**GOAL, "duration": -math.inf}),
        ("bad_message", "duration", {**GOAL, "duration": "1 s"}),
        ("bad_message", "limits.velocities", {**GOAL, "limits": {"velocities": [1.0]}}),
        ("bad_message", "limits.positions", {**GOAL, "limits": {"positions": [None] * 5}}),
        ("bad_message", "limits.speeds", {**GOAL, "limits": {"speeds": [1.0] * JOINTS}}),
        ("bad_message", "waypoints[0].time_from_start", {**GOAL, "waypoints": [{}]}),
        ("bad_message", "waypoints[0].positions", {**GOAL, "waypoints": [{"time_from_start": 0.5, "positions": [1]}]}),
        ("bad_message", "start.positions", {**GOAL, "plan_only": True, "start": {"positions": []}}),
        ("bad_message", "tail", {**GOAL, "tail": "roll"}),
        ("bad_message", "plan_only", {**GOAL, "plan_only": 1}),
        ("invalid_goal", "duration", {**GOAL, "duration": 0.0}),
        ("invalid_goal", "duration", {**GOAL, "duration": -1}),
        ("invalid_goal", "duration", {**GOAL, "duration": 60.1}),
        ("invalid_goal", "duration", {**GOAL, "duration": 1e-300}),
        ("invalid_goal", "duration", {**GOAL, "duration": HUGE}),
        ("invalid_goal", "arrival_time", {**GOAL, "duration": 1.0, "arrival_time": 1.0}),
        ("invalid_goal", "arrival_time", {**GOAL, "arrival_time": HUGE}),
        ("invalid_goal", "start", {**GOAL, "start": {"positions": HOME}}),
        ("invalid_goal", "tail", {**GOAL, "tail": "coast"}),
        ("invalid_goal", "client_id", {**GOAL, "lease": True}),
        ("invalid_goal", "goal_id", {**GOAL, "goal_id": ""}),
        ("invalid_goal", "goal_id", {**GOAL, "goal_id": "x" * 129}),
        ("invalid_goal", "rest_fraction", {**GOAL, "rest_fraction": 1.0}),
        ("invalid_goal", "rest_fraction", {**GOAL, "rest_fraction": -HUGE}),
        ("invalid_goal", "accelerations", {**GOAL, "rest_fraction": 0.2, "accelerations": [1.0] + [None] * 5}),
        ("invalid_goal", "waypoints[0].time_from_start", {**GOAL, "waypoints": [{"time_from_start": 2.0}]}),
        ("invalid_goal", "waypoints[0].time_from_start", {**GOAL, "waypoints": [{"time_from_start": HUGE}]}),
        ("invalid_goal", "limits.velocities", {**GOAL, "limits": {"velocities": [0.0] + [None] * 5}}),
        ("invalid_goal", "limits.jerks", {**GOAL, "limits": {"jerks": [-HUGE] + [None] * 5}}),
        ("invalid_goal", "limits.positions", {**GOAL, "limits": {"positions": [[1.0, -1.0]] + [None] * 5}}),
        ("invalid_goal", "limits.positions", {**GOAL, "limits": {"positions": [[90.0, 99.0]] + [None] * 5}}),
        ("unknown_primitive", None, {**GOAL, "primitive": "backhand"}),
        ("unknown_primitive", None, {**GOAL, "primitive": "../forehand"}),
        ("late", None, {**GOAL, "arrival_time": 0.0}),
        ("late", None, {**GOAL, "arrival_time": -HUGE}),
    ],
)
def test_goals(stack: Stack, code: str, field: str | None, body: dict[str, object]):
    """A goal that is malformed or contradicts itself is refused; the refusal names the field."""
    refuse(stack, "goal", code, field, **body)


@pytest.mark.parametrize(
    ("quantity", "fields"),
    [
        ("position", {"positions": [HUGE, *HOME[1:]]}),
        ("position", {"positions": [-2.6, *HOME[1:]], "velocities": [1.0] + [0.0] * 5}),
        ("velocity", {"velocities": [15.1] + [0.0] * 5}),
        ("velocity", {"velocities": [-HUGE] + [0.0] * 5}),
        ("acceleration", {"velocities": [1.0] + [0.0] * 5, "accelerations": [-301.0] + [None] * 5}),
        ("acceleration", {"velocities": [1.0] + [0.0] * 5, "accelerations": [HUGE] + [None] * 5}),
        ("position", {"waypoints": [{"time_from_start": 0.5, "positions": [HUGE] + [None] * 5}]}),
        ("velocity", {"waypoints": [{"time_from_start": 0.5, "velocities": [16.0] + [None] * 5}]}),
        ("position", {"limits": {"positions": [[0.1, 0.5]] + [None] * 5}}),
        ("position", {"plan_only": True, "start": {"positions": [3.0, *HOME[1:]]}}),
    ],
)
def test_goals_outside_the_limits(stack: Stack, quantity: str, fields: dict[str, object]):
    """The refusal `limit` names the joint, the quantity, the value and the bound."""
    refusal = refuse(stack, "goal", "limit", None, **GOAL | fields)
    detail = refusal["detail"]
    assert (detail["joint"], detail["quantity"]) == ("joint_1", quantity)
    assert abs(detail["value"] - detail["bound"]) > 0
    assert "joint_1" in refusal["message"]


def demonstration(samples: int = 100) -> list[list[float]]:
    """Return a small movement of every joint."""
    return [[math.sin(3.0 * k / samples)] * JOINTS for k in range(samples)]


@pytest.mark.parametrize(
    ("code", "field", "body"),
    [
        ("bad_message", "name", {}),
        ("bad_message", "name", {"name": "../escape"}),
        ("bad_message", "name", {"name": ""}),
        ("bad_message", "name", {"name": "x" * 65}),
        ("bad_message", "positions", {"positions": []}),
        ("bad_message", "positions", {"positions": [[0.0] * 6, [0.0] * 5]}),
        ("bad_message", "positions", {"positions": [[]]}),
        ("bad_message", "positions", {"positions": [[0.0] * 6] * 2}),
        ("bad_message", "positions[3][1]", {"positions": [*demonstration(3), [0.0, math.nan]]}),
        ("bad_message", "positions", {"positions": [[HUGE * (-1) ** k] * 6 for k in range(100)]}),
        ("bad_message", "positions", {"positions": b"", "joint_count": 6}),
        ("bad_message", "joint_count", {"positions": bytes(48)}),
        ("bad_message", "joint_count", {"positions": bytes(48), "joint_count": 0}),
        ("bad_message", "positions", {"positions": bytes(47), "joint_count": 6}),
        ("bad_message", "positions", {"positions": bytes(48), "joint_count": 1 << 60}),
        ("bad_message", "positions", {"positions": matrix_bytes(ROBOT.home * math.nan), "joint_count": 6}),
        ("bad_message", "rate", {"rate": None}),
        ("bad_message", "rate", {"rate": 0.0}),
        ("bad_message", "rate", {"rate": -HUGE}),
        ("bad_message", "rate", {"rate": 1e-308}),
        ("bad_message", "rate", {"rate": HUGE}),
        ("bad_message", "times", {"rate": None, "times": [k * 1e-300 for k in range(100)]}),
        ("bad_message", "times", {"rate": None, "times": [0.0, 0.1]}),
        ("bad_message", "times", {"rate": None, "times": [0.0] * 100}),
        ("bad_message", "smoothing", {"smoothing": "much"}),
        ("bad_message", "smoothing", {"smoothing": {"window_s": -1.0, "order": 3}}),
        ("bad_message", "smoothing", {"smoothing": {"window_s": HUGE, "order": 3}}),
        ("bad_message", "smoothing.order", {"smoothing": {"window_s": 0.9, "order": 80}}),
        ("exists", None, {"name": "forehand"}),
    ],
)
def test_demonstrations(stack: Stack, code: str, field: str | None, body: dict[str, object]):
    """A demonstration that cannot be learned is refused; the refusal names the field and the library is unchanged."""
    good: dict[str, object] = {"name": "wave", "positions": demonstration(), "rate": 100.0}
    whole = {} if field == "name" and not body else {**good, **body}
    refuse(stack, "learn", code, field, **whole)
    assert [entry.name for entry in stack.bus.ask(topics.PRIMITIVES, m.Empty()).primitives] == ["forehand"]
