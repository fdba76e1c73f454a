"""Throws of the launcher, flown in the simulation, and scores of returns."""

from dataclasses import replace

import numpy as np
import pytest

from protocol.messages import BallState, Contact, Throw
from robot.description import load_robot
from robot.striking.launcher import Launcher, NoThrow
from robot.striking.scoring import Score, score
from services.common.robot_side.backend import Setpoint
from services.sim.arm import SimulatedArm

ROBOT = load_robot()
assert ROBOT.court is not None
COURT = ROBOT.court
STILL = Setpoint(*(np.zeros(6) for _ in range(4)))
AWAY = [2.1, -0.9, -0.4, 0.0, 0.0, 0.0]
"""Pose in which the arm points backwards, outside the ball's path, rad."""


@pytest.mark.parametrize(("kind", "tolerance"), [("volley", 0.02), ("bounce", 0.2)])
def test_a_throw_arrives_at_its_drawn_position(kind, tolerance):
    """Errors: one integration step for a volley; for a bounce a restitution of 0.80 to 0.84, over 0.4 s of flight."""
    launcher = Launcher(ROBOT, seed=3, kind=kind)
    for _ in range(4):
        launch = launcher.next()
        arm = SimulatedArm(ROBOT)
        arm.reset(positions=AWAY)
        arm.throw(Throw(position=launch.position, velocity=launch.velocity))
        touched = []
        for _ in range(round(launch.flight_time * 1000)):
            arm.step(STILL)
            touched += [contact.bodies for contact in arm.contacts() if contact.ended]
        ball = arm.ball() or pytest.fail("there is a ball")
        assert touched == [["floor", "ball"]] * launch.bounces
        assert np.linalg.norm(np.subtract(ball.position, launch.arrival)) < tolerance


def test_throws_are_determined_by_the_seed_and_cover_the_reach():
    throws = [[launcher.next() for _ in range(30)] for launcher in (Launcher(ROBOT, 1), Launcher(ROBOT, 1))]
    assert throws[0] == throws[1]
    spread = np.ptp([launch.arrival for launch in throws[0]], axis=0)
    assert (spread > [0.8, 0.8, 0.6]).all()
    assert min(launch.position[0] for launch in throws[0]) > 2.8, "from beyond the net"


def test_a_launcher_without_a_court_is_refused():
    with pytest.raises(NoThrow, match=r"arm has no ball, or no court with a net"):
        Launcher(replace(ROBOT, court=None))


def touch(time: float, body: str) -> Contact:
    return Contact(time=time, bodies=[body, "ball"], impulse=0.1, ball_velocity=None, ended=False)


SIGHTS = [BallState(time=1.5, position=[4.0, 0.5, 0.1], velocity=[5.0, 0.0, -4.0])]
HIT = Score(True, 1.0, landed_at=(4.05, 0.5, 0.1 - 0.04 - 9.81 * 5e-5), landed_time=1.51, distance=0.05, returned=True)


@pytest.mark.parametrize(
    ("contacts", "expected"),
    [
        ([], Score()),
        ([touch(0.5, "floor")], Score()),
        ([touch(1.0, "racket")], Score(True, 1.0)),
        ([touch(0.5, "floor"), touch(1.0, "racket"), touch(1.51, "floor"), touch(2.0, "net")], HIT),
        ([touch(1.0, "racket"), touch(1.3, "net"), touch(1.51, "floor")], replace(HIT, net=True)),
        ([touch(1.0, "racket"), touch(2.0, "floor")], Score(True, 1.0, landed_time=2.0)),
    ],
)
def test_a_return_is_scored_from_contacts_and_sights(contacts, expected):
    found = score(contacts, SIGHTS, COURT, ROBOT.bodies, (4.0, 0.5, 0.0))
    assert found.landed_at == (None if expected.landed_at is None else pytest.approx(expected.landed_at))
    assert found.distance == (None if expected.distance is None else pytest.approx(expected.distance))
    assert replace(found, landed_at=None, distance=None) == replace(expected, landed_at=None, distance=None)


def test_a_ball_that_lands_before_the_net_is_not_returned():
    short = [at_x(SIGHTS[0], 2.0)]
    assert not score([touch(1.0, "racket"), touch(1.51, "floor")], short, COURT, ROBOT.bodies, (4.0, 0.5, 0.0)).returned


def at_x(sight: BallState, x: float) -> BallState:
    return BallState(time=sight.time, position=[x, *sight.position[1:]], velocity=sight.velocity)
