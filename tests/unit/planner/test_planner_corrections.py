"""The motion that a goal corrects, and the phase of the demonstration at which the correction begins."""

import pytest

from protocol import messages as m
from protocol.errors import Refusal
from services.planner.corrections import KEPT, Correction, Corrections

ZEROS = [0.0] * 2

END = (0.5, 1.0)
"""Posture at the hit, rad."""


def goal(goal_id: str, revises: str | None = None, primitive: str = "forehand") -> m.Goal:
    return m.Goal(primitive=primitive, goal_id=goal_id, revises=revises)


def reference(time: float, goal_id: str | None) -> m.Reference:
    return m.Reference(time=time, epoch=1, positions=ZEROS, velocities=ZEROS, accelerations=ZEROS, goal_id=goal_id)


@pytest.fixture
def corrections() -> Corrections:
    """Corrections with one motion from 10 s that hits at 12 s."""
    kept = Corrections()
    kept.note(goal("first"), "first", 10.0, 2.0, 0.0, END)
    return kept


def test_a_goal_without_revises_is_no_correction(corrections: Corrections):
    assert corrections.correction(goal("new"), reference(10.5, "first")) is None


def test_the_phase_increases_uniformly_to_the_hit(corrections: Corrections):
    """From the phase at which the motion, or the correction, began."""
    assert corrections.correction(goal("a", "first"), reference(10.5, "first")) == Correction(0.25, 12.0, END)
    corrections.note(goal("a", "first"), "a", 10.5, 1.0, 0.25, END)
    assert corrections.correction(goal("b", "first"), reference(11.0, "a")) == Correction(0.625, 11.5, END)


def test_any_goal_of_a_chain_of_corrections_can_be_revised(corrections: Corrections):
    corrections.note(goal("a", "first"), "a", 10.5, 1.5, 0.25, END)
    corrections.note(goal("b", "a"), "b", 11.0, 1.0, 0.5, END)
    for revised in ("first", "a", "b"):
        assert corrections.correction(goal("c", revised), reference(11.5, "b")) == Correction(0.75, 12.0, END)


def test_a_correction_before_the_start_of_an_accepted_one_continues_the_present_motion(corrections: Corrections):
    """The reference has the goal id of its motion."""
    corrections.note(goal("a", "first"), "a", 11.0, 1.0, 0.5, END)
    assert corrections.correction(goal("b", "a"), reference(10.5, "first")) == Correction(0.25, 12.0, END)


@pytest.mark.parametrize(
    ("asked", "at", "ahead"),
    [
        (goal("x", "first"), reference(9.5, None), 0.5),
        (goal("x", "a"), reference(9.5, "ready"), 0.5),
        (goal("x", "first"), reference(10.5, "first"), 0.0),
        (goal("x", "first"), reference(11.5, None), 0.0),
        (goal("x", "old"), reference(0.5, None), 0.0),
        (goal("x", "absent"), reference(9.5, None), 0.0),
        (goal("x"), reference(9.5, None), 0.0),
    ],
)
def test_a_correction_waits_for_the_start_of_its_motion(
    corrections: Corrections, asked: m.Goal, at: m.Reference, ahead: float
):
    """A motion has a longer lead than its correction, which can be requested before the motion starts."""
    corrections.note(goal("a", "first"), "a", 11.0, 1.0, 0.5, END)
    corrections.note(goal("old"), "old", 70.0, 1.0, 0.0, END)  # of an earlier run
    assert corrections.until_begin(asked, at) == pytest.approx(ahead)


@pytest.mark.parametrize(
    ("asked", "at", "code"),
    [
        (goal("x", "absent"), reference(10.5, "first"), "unknown_goal"),
        (goal("x", "first", "backhand"), reference(10.5, "first"), "invalid_goal"),
        (goal("x", "first"), reference(12.0, "first"), "late"),
        (goal("x", "first"), reference(13.0, None), "late"),
        (goal("x", "first"), reference(11.0, None), "superseded"),
        (goal("x", "first"), reference(11.0, "other"), "superseded"),
        (goal("x", "first"), reference(11.0, "unknown"), "superseded"),
    ],
)
def test_corrections_that_are_impossible_are_refused(
    corrections: Corrections, asked: m.Goal, at: m.Reference, code: str
):
    corrections.note(goal("other"), "other", 11.0, 1.0, 0.0, END)
    with pytest.raises(Refusal) as refusal:
        corrections.correction(asked, at)
    assert refusal.value.code == code
    if code == "late":
        said = f"the hit of goal 'first' was due at 12.000 s, but a correction can begin at {at.time:.3f} s"
        assert said in str(refusal)


def test_the_oldest_motions_are_forgotten(corrections: Corrections):
    for index in range(KEPT):
        corrections.note(goal(f"g{index}"), f"g{index}", 20.0, 1.0, 0.0, END)
    with pytest.raises(Refusal, match="first"):
        corrections.correction(goal("x", "first"), reference(10.5, "first"))
    assert corrections.correction(goal("x", "g0"), reference(20.5, "g0")) == Correction(0.5, 21.0, END)


def test_the_first_goal_of_a_long_chain_is_not_forgotten(corrections: Corrections):
    """As long as corrections refer to it."""
    for index in range(2 * KEPT):
        corrections.note(goal(f"g{index}", "first"), f"g{index}", 10.0, 2.0, 0.0, END)
    last = f"g{2 * KEPT - 1}"
    assert corrections.correction(goal("x", "first"), reference(10.5, last)) == Correction(0.25, 12.0, END)
