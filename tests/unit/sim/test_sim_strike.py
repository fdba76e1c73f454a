"""The shipped forehand played by the simulated arm, with and without a hit, and contacts of the ball."""

import numpy as np
import pytest
from setpoints import accelerating

from deploy.demonstrations.make_forehand import FOREHAND
from motion.braking import stop
from motion.tracking import tracking_acceleration
from motion.trajectory import Samples
from protocol.messages import Ball, Contact
from robot.description import load_robot
from services.sim.arm import SimulatedArm

ROBOT = load_robot()
HIT = 1000
"""Tick of the hit."""


def forehand() -> Samples:
    """Return the demonstration at 1 kHz followed by a stop; accelerations are the means over each tick."""
    table = np.loadtxt(FOREHAND, delimiter=",", skiprows=1)
    times = np.arange(HIT + 1) / 1000
    positions = np.stack([np.interp(times, table[:, 0], joint) for joint in table[:, 1:].T], axis=1)
    velocities = np.gradient(positions, times, axis=0)
    tail = stop(positions[-1], velocities[-1], np.zeros(6), ROBOT.limits).sample(np.arange(1, 500) / 1000)
    positions = np.concatenate([positions, tail.positions])
    velocities = np.concatenate([velocities, tail.velocities])
    accelerations = np.diff(velocities, axis=0, append=velocities[-1:]) * 1000
    return Samples(positions, velocities, accelerations)


def play(ball: Ball | None) -> tuple[list[Contact], np.ndarray]:
    """Play the forehand to rest; return all contacts and the tracking error at each tick (ticks, J), rad."""
    arm = SimulatedArm(ROBOT)
    arm.reset(ball=ball)
    reference = forehand()
    contacts, errors = [], []
    for position, velocity, acceleration in zip(
        reference.positions, reference.velocities, reference.accelerations, strict=True
    ):
        seen = arm.observe()
        errors.append(np.abs(seen.positions - position))
        target = (position, velocity, acceleration)
        arm.step(accelerating(tracking_acceleration(ROBOT.alpha, target, seen.positions, seen.velocities)))
        contacts += arm.contacts()
        assert not seen.saturated.any()
    return contacts, np.array(errors)


def test_the_racket_hits_the_ball_at_the_planned_time_and_forwards():
    contacts, errors = play(ball=None)
    assert [contact.bodies for contact in contacts] == 2 * [["racket", "ball"]], "one contact, and none with the tee"
    touch, contact = contacts
    assert (touch.ended, touch.time, touch.ball_velocity) == (False, contact.time, None)
    assert 0.01 <= touch.impulse < contact.impulse
    assert contact.ended
    assert HIT / 1000 <= contact.time <= HIT / 1000 + 0.002
    assert errors[: HIT + 1].max() < 1e-3
    assert errors.max() < ROBOT.max_tracking_error
    velocity = np.array(contact.ball_velocity)
    assert 6 < np.linalg.norm(velocity) < 9
    assert velocity[0] > 0.9 * np.linalg.norm(velocity), "forwards"
    assert 0 < velocity[2] < 1, "slightly up"
    momentum = ROBOT.load_model().body("ball").mass[0] * np.linalg.norm(velocity)
    assert contact.impulse == pytest.approx(momentum, rel=0.15)
    assert errors[-1].max() < 1e-3, "the arm has returned to its reference"


def test_without_a_hit_there_is_no_contact():
    contacts, errors = play(ball=Ball(position=(2.0, 2.0, 1.0)))
    assert contacts == []
    assert errors.max() < 1e-3


def test_a_bounce_is_a_single_contact():
    arm = SimulatedArm(ROBOT)
    arm.reset(ball=Ball(position=(2.0, 2.0, 0.5), velocity=(0.0, 0.0, -1.0)))
    contacts = []
    for _ in range(400):
        arm.step(accelerating(np.zeros(6)))
        contacts += arm.contacts()
    assert [(contact.bodies, contact.ended) for contact in contacts] == [
        (["floor", "ball"], False),
        (["floor", "ball"], True),
    ]
    fall = np.sqrt(1 + 2 * 9.81 * (0.5 - 0.033))
    contact = contacts[-1]
    assert contact.time == pytest.approx((fall - 1) / 9.81, abs=0.002)
    assert contact.ball_velocity is not None
    assert 0.7 * fall < contact.ball_velocity[2] < 0.9 * fall, "the ball's restitution"
    assert contact.impulse == pytest.approx(0.057 * (fall + contact.ball_velocity[2]), rel=0.05)


def test_a_settling_ball_causes_few_contacts():
    arm = SimulatedArm(ROBOT)
    arm.reset(ball=Ball(position=(2.0, 2.0, 0.1), velocity=(-1.0, 0.0, 0.0)))
    contacts = []
    for _ in range(3000):
        arm.step(accelerating(np.zeros(6)))
        contacts += [contact for contact in arm.contacts() if contact.ended]
    assert 5 < len(contacts) < 20
    assert contacts[-1].time < 1.5
    impulses = [contact.impulse for contact in contacts]
    assert impulses == sorted(impulses, reverse=True)
