"""Names of joints in refusals that give a value by its index; ids of refused goals."""

import pytest

from protocol.codec import bad_message, decode, encode
from protocol.errors import Refusal
from protocol.messages import Goal
from services.common.refusing import with_goal, with_joint

NAMES = "pan", "lift", "elbow"


@pytest.mark.parametrize(
    ("said", "named"),
    [
        ("positions[0] is nan; it must", "positions[0] (joint pan) is nan; it must"),
        ("velocities[2]: expected `float`", "velocities[2] (joint elbow): expected `float`"),
        ("start.accelerations[1] is inf;", "start.accelerations[1] (joint lift) is inf;"),
        ("limits.jerks[1] is nan;", "limits.jerks[1] (joint lift) is nan;"),
        ("limits.positions[2][1] is nan;", "limits.positions[2][1] (joint elbow) is nan;"),
        ("waypoints[7].positions[1] is nan;", "waypoints[7].positions[1] (joint lift) is nan;"),
        ("alternatives[12].velocities[0] is nan;", "alternatives[12].velocities[0] (joint pan) is nan;"),
        ("positions[450][2] is nan;", "positions[450][2] (joint elbow) is nan;"),
        ("positions[3] is nan;", "positions[3] is nan;"),
        ("positions has 2 entries; the arm has 3", "positions has 2 entries; the arm has 3"),
        ("waypoints[0].time_from_start is nan;", "waypoints[0].time_from_start is nan;"),
        ("tool.position[0] is nan;", "tool.position[0] is nan;"),
    ],
)
def test_an_index_is_followed_by_the_name_of_its_joint(said: str, named: str):
    refusal = with_joint(Refusal("bad_message", said, field="f"), NAMES)
    assert (refusal.code, refusal.message, refusal.detail) == ("bad_message", named, {"field": "f"})


def test_a_decoded_goal():
    """The field stays as it is, because clients parse it."""
    body = encode(Goal(primitive="wave", positions=[0.0, float("nan"), 0.0]))
    with pytest.raises(Refusal) as caught:
        decode(body, Goal)
    refusal = with_joint(caught.value, NAMES)
    assert refusal.message == "positions[1] (joint lift) is nan; it must be finite"
    assert refusal.detail == {"field": "positions[1]"}


def test_without_names_nothing_changes():
    refusal = bad_message("positions[0]", "positions[0] is nan; it must be finite")
    assert with_joint(refusal, ()) is refusal


@pytest.mark.parametrize(
    ("refusal", "detail"),
    [
        (Refusal("unavailable", "no answer", service="controller"), {"service": "controller", "goal_id": "g"}),
        (Refusal("late", "has passed", goal_id=None), {"goal_id": "g"}),
        (Refusal("late", "the hit has passed", goal_id="revised"), {"goal_id": "revised"}),
        (Refusal("busy", "the queue is full", goal_id=None), {"goal_id": None}),
    ],
)
def test_a_refused_goal_is_named(refusal: Refusal, detail: dict[str, str | None]):
    """Unless the detail names another goal, or could."""
    assert with_goal(refusal, "g").detail == detail
    assert with_goal(refusal, None) is refusal
