"""What the planner remembers of motions that it had played."""

import pytest

from protocol import messages as m
from protocol.errors import Refusal
from services.planner.corrections import KEPT, Corrections


def swing(**fields: object) -> m.Goal:
    """A goal of the forehand."""
    return m.Goal(primitive="forehand", **fields)  # type: ignore[arg-type]


def reference(time: float, goal_id: str | None) -> m.Reference:
    """A point of a motion."""
    return m.Reference(time=time, epoch=1, positions=[0.0], velocities=[0.0], accelerations=[0.0], goal_id=goal_id)


def test_the_first_of_a_long_chain_stays_known():
    """While corrections name it, however many there are."""
    corrections = Corrections()
    corrections.note(swing(), "first", 0.0, 100.0, 0.0)
    for k in range(2 * KEPT):
        corrections.note(swing(revises="first"), f"correction {k}", 0.01 * k, 100.0 - 0.01 * k, 1e-4 * k)
    last = f"correction {2 * KEPT - 1}"
    found = corrections.correction(swing(revises="first"), reference(50.0, last))
    assert found is not None
    assert found.hit_time == pytest.approx(100.0)


def test_a_motion_that_nothing_named_is_forgotten_at_last():
    """After as many others."""
    corrections = Corrections()
    for k in range(KEPT + 1):
        corrections.note(swing(), f"goal {k}", 1.0 * k, 1.0, 0.0)
    with pytest.raises(Refusal) as caught:
        corrections.correction(swing(revises="goal 0"), reference(0.5, "goal 0"))
    assert caught.value.code == "unknown_goal"
    found = corrections.correction(swing(revises="goal 1"), reference(1.5, "goal 1"))
    assert found is not None
    assert (found.phase, found.hit_time) == (0.5, 2.0)
