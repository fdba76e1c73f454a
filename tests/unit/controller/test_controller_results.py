"""Results of motions: touches, clipped torques, and hits outside their tolerance."""

import dataclasses

import pytest
from msgspec import UNSET, UnsetType

from protocol import messages as m
from robot.schema import Tolerance
from services.controller.core import Controller
from services.controller.incidents import touch_of
from tests.unit.controller.perfect_arm import JOINTS, ROBOT, PerfectArm, execute, trajectory


@pytest.mark.parametrize(
    ("bodies", "touch"),
    [
        (["racket", "ball"], m.FirstContact(body="racket", other="ball", time=0.05)),
        (["floor", "racket"], m.FirstContact(body="racket", other="floor", time=0.05)),
        (["forearm", "shoulder"], m.FirstContact(body="forearm", other="shoulder", time=0.05)),
        (["floor", "ball"], None),
        (["racket"], None),
    ],
)
def test_contacts_are_assigned_to_the_arm(bodies: list[str], touch: m.FirstContact | None):
    assert touch_of(m.Contact(time=0.05, bodies=bodies, impulse=1.0, ball_velocity=None), ROBOT) == touch


def test_a_result_has_the_first_touch_and_the_clipped_ticks(arm: PerfectArm):
    """Touches before the motion began do not count."""
    execute(arm, trajectory(arm.controller, 30))
    ledger = arm.controller.ledger
    ledger.note_touch(m.FirstContact(body="racket", other="floor", time=0.02), 20)
    arm.turn(100)
    for name in ("ball", "post"):
        ledger.note_touch(m.FirstContact(body="racket", other=name, time=0.05), 50)
    for _ in range(3):
        arm.controller.answer(arm.state(saturated=[True] + [False] * (JOINTS - 1)), 0)
        arm.tick += 1
    result = ledger.result("goal")
    assert result.first_contact == m.FirstContact(body="racket", other="ball", time=0.05)
    assert result.saturated_ticks == 3


@pytest.mark.parametrize(
    ("robot", "goal", "outcome"),
    [
        (Tolerance(), UNSET, "succeeded"),
        (Tolerance(positions=0.01), UNSET, "missed"),
        (Tolerance(positions=0.01), m.Tolerance(positions=0.1), "succeeded"),
        (Tolerance(positions=0.01), m.Tolerance(velocities=1.0), "missed"),
        (Tolerance(), m.Tolerance(velocities=0.01), "missed"),
    ],
)
def test_a_hit_outside_its_tolerance_is_missed(robot: Tolerance, goal: m.Tolerance | UnsetType, outcome: m.Outcome):
    """The tolerance is the goal's or, if that is null, the robot's."""
    arm = PerfectArm(Controller(dataclasses.replace(ROBOT, tolerance=robot)))
    arm.turn(10)
    execute(arm, trajectory(arm.controller, 30, tolerance=goal))
    arm.turn(220)
    arm.positions[1] += 0.05
    arm.velocities[1] += 0.05
    arm.turn(400)
    result = arm.controller.ledger.result("goal")
    assert result.outcome == outcome
    assert ("joint_2 was" in result.reason) == (outcome == "missed")
