"""A ball thrown at the arm, over the bus: its flight is as computed; it is hit, bounces and is scored."""

from pathlib import Path

import numpy as np
import pytest
from harness import ROBOT, running, wait_for

from protocol import messages as m
from protocol import topics
from robot.kinematics import Kinematics
from robot.striking.scoring import Score, score

TARGET = (4.0, 0.0, 0.0)


def flight(throw: m.Throw, times: list[float]) -> np.ndarray:
    """Return positions (N, 3), m, under gravity, drag and spin, integrated with the simulation's own steps."""
    ball = ROBOT.ball
    assert ball is not None
    position, velocity, spin = (
        np.array(vector) for vector in (throw.position, throw.velocity, throw.spin or (0.0, 0.0, 0.0))
    )
    path = [position]
    for _ in range(round(max(times) * ROBOT.rate_hz)):
        drag = -ball.drag * np.linalg.norm(velocity) * velocity
        velocity = velocity + (drag + ball.magnus * np.cross(spin, velocity) - [0, 0, 9.81]) * ROBOT.tick
        position = position + velocity * ROBOT.tick
        path.append(position)
    return np.array(path)[[round(time * ROBOT.rate_hz) for time in times]]


def scored_of(contacts: list[m.Contact], sights: list[m.BallState]) -> Score:
    assert ROBOT.court is not None
    return score(contacts, sights, ROBOT.court, ROBOT.bodies, TARGET)


def test_a_thrown_ball_flies_is_hit_and_scored(tmp_path: Path):
    """The racket is at rest; the flight before the touch is exact to the rounding of 250 steps."""
    x, y, z = Kinematics(ROBOT).tool_pose(ROBOT.home)[0].tolist()
    throw = m.Throw(position=(x + 1.5, y, z), velocity=(-5.2, 0.0, 1.4), spin=(0.0, 20.0, 0.0))
    sights: list[m.BallState] = []
    contacts: list[m.Contact] = []

    def landed() -> bool:
        """Take what was published, and return whether it contains the last sight and the landing."""
        sights.extend(stack.drain(topics.BALL))
        contacts.extend(stack.drain(topics.CONTACT))
        seen = bool(sights) and sights[-1].time >= begun + 0.99
        return seen and scored_of(contacts, sights).landed_at is not None

    with running(tmp_path) as stack:
        stack.reset(seed=1)
        assert stack.bus.ask(topics.DESCRIPTION, m.Empty()).ball_rate_hz == 100.0
        stack.drain(topics.BALL)
        stack.drain(topics.CONTACT)
        run = stack.bus.ask(topics.STATE_QUERY, m.Empty()).run
        begun = stack.bus.ask(topics.SIM_BALL, throw).time
        stack.step(1000)
        wait_for(landed, "the ball to be scored")
        assert stack.bus.ask(topics.STATE_QUERY, m.Empty()).run == run, "a throw begins no new run"
    scored = scored_of(contacts, sights)
    assert scored.hit
    assert scored.hit_time == pytest.approx(0.29, abs=0.02)
    before = [sight for sight in sights if begun < sight.time < (scored.hit_time or 0.0)]
    assert len(before) > 20
    seen = np.array([sight.position for sight in before])
    np.testing.assert_allclose(seen, flight(throw, [sight.time - begun for sight in before]), atol=1e-9)
    assert scored.landed_at is not None
    assert scored.landed_at[2] == pytest.approx(0.033, abs=0.02), "it does not land a ball's radius above the floor"
    assert scored.distance == pytest.approx(np.hypot(scored.landed_at[0] - 4.0, scored.landed_at[1]))
    assert (scored.net, scored.returned) == (False, False), "a racket at rest returned the ball over the net"
