"""A ball that is thrown at the arm, over the bus: it flies as computed, is hit, bounces, and is scored."""

from pathlib import Path

import numpy as np
import pytest
from harness import ROBOT, running
from waiting import eventually

from protocol import messages as m
from protocol import topics
from protocol.codec import decode
from robot.kinematics import Kinematics
from robot.striking.scoring import Score, score

TARGET = (4.0, 0.0, 0.0)


def flight(throw: m.Throw, times: list[float]) -> np.ndarray:
    """Return positions (N, 3), m, by small steps of gravity, drag and spin; the steps are the simulation's own."""
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
    """The racket rests; the flight before the touch is exact to the rounding of the sum of 250 steps."""
    x, y, z = Kinematics(ROBOT).tool_pose(ROBOT.home)[0].tolist()
    throw = m.Throw(position=(x + 1.5, y, z), velocity=(-5.2, 0.0, 1.4), spin=(0.0, 20.0, 0.0))
    sights: list[m.BallState] = []
    contacts: list[m.Contact] = []
    with running(tmp_path) as stack:
        stack.reset(seed=1)
        assert stack.bus.ask(topics.DESCRIPTION, m.Empty()).ball_rate_hz == 100.0
        kept = [
            stack.bus.listen(topics.BALL, lambda body: sights.append(decode(body, m.BallState))),
            stack.bus.listen(topics.CONTACT, lambda body: contacts.append(decode(body, m.Contact))),
        ]
        run = stack.bus.ask(topics.STATE_QUERY, m.Empty()).run
        begun = stack.bus.ask(topics.SIM_BALL, throw).time
        stack.step(1000)
        assert eventually(lambda: sights and sights[-1].time >= begun + 0.99)
        assert eventually(lambda: scored_of(contacts, sights).landed_at is not None)  # contacts come by another thread
        assert stack.bus.ask(topics.STATE_QUERY, m.Empty()).run == run, "no new run"
        assert len(kept) == 2
    scored = scored_of(contacts, sights)
    assert scored.hit
    assert scored.hit_time == pytest.approx(0.29, abs=0.02)
    before = [sight for sight in sights if begun < sight.time < (scored.hit_time or 0.0)]
    assert len(before) > 20
    seen = np.array([sight.position for sight in before])
    np.testing.assert_allclose(seen, flight(throw, [sight.time - begun for sight in before]), atol=1e-9)
    assert scored.landed_at is not None
    assert scored.landed_at[2] == pytest.approx(0.033, abs=0.02), "a ball's radius above the floor"
    assert scored.distance == pytest.approx(np.hypot(scored.landed_at[0] - 4.0, scored.landed_at[1]))
    assert (scored.net, scored.returned) == (False, False), "a racket that rests sends no ball over the net"
