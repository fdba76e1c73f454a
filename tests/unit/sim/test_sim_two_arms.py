"""Two arms in separate simulations of one scene: each places the other by its states, and plans avoid it."""

import numpy as np
import pytest
from setpoints import accelerating

from robot.clearance import Clearance
from robot.description import load_robot
from robot.shipped import DEFAULT_ROBOT_CONFIG
from services.sim.arm import SimulatedArm

LEFT = load_robot(DEFAULT_ROBOT_CONFIG.with_name("left.toml"))
RIGHT = load_robot(DEFAULT_ROBOT_CONFIG.with_name("right.toml"))
STILL = accelerating(np.zeros(6))
MEETS = -0.8
"""Angle of the right arm's first joint at which it touches the left arm at home, rad."""


def turned(angle: float) -> list[float]:
    return [angle, *RIGHT.home[1:].tolist()]


def right_joint(arm: SimulatedArm) -> float:
    return arm.surroundings()["right/joint_1"][0]


def test_each_description_has_the_other_arms_joints():
    assert LEFT.others["right"] == RIGHT.joint_names
    assert RIGHT.others["left"] == LEFT.joint_names


def test_the_other_arm_rests_until_its_states_arrive_and_then_follows_them():
    arm = SimulatedArm(LEFT)
    for _ in range(200):
        arm.step(STILL)
    assert right_joint(arm) == pytest.approx(0.0, abs=1e-4)
    for k in range(1, 101):
        arm.lead(RIGHT.joint_names, turned(k * 1e-3), [1.0, *[0.0] * 5])
        arm.step(STILL)
    assert right_joint(arm) == pytest.approx(0.101, abs=1e-4)  # extrapolated by one tick
    for _ in range(50):
        arm.step(STILL)
    assert right_joint(arm) == pytest.approx(0.1, abs=1e-4)
    assert arm.observe().positions == pytest.approx(LEFT.home, abs=1e-4)


def test_the_other_arm_can_touch_this_arm():
    arm = SimulatedArm(LEFT)
    arm.lead(RIGHT.joint_names, turned(MEETS), [0.0] * 6)
    touches = []
    for _ in range(5):
        arm.step(STILL)
        touches += [contact.bodies for contact in arm.contacts()]
    assert touches
    assert all({body.partition("/")[0] for body in bodies} == {"left", "right"} for bodies in touches)


def test_clearance_accounts_for_the_other_arms_position():
    clearance = Clearance(LEFT, LEFT.load_model())
    between = [k for k, pair in enumerate(clearance.pairs) if any(body.startswith("right/") for body in pair.bodies)]
    clearance.place(LEFT.home)
    assert min(clearance.distance(k) for k in between) > 0.2
    clearance.surround(RIGHT.joint_names, turned(MEETS))
    clearance.place(LEFT.home)
    assert min(clearance.distance(k) for k in between) < 0
