"""Two arms in one scene: each sim has the other arm where it is said to be, and feels it; plans look at it."""

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
"""By so much the right arm's first joint turns to meet the left arm at home, rad."""


def turned(angle: float) -> list[float]:
    return [angle, *RIGHT.home[1:].tolist()]


def right_joint(arm: SimulatedArm) -> float:
    return arm.surroundings()["right/joint_1"][0]


def test_they_name_each_others_joints():
    assert LEFT.others["right"] == RIGHT.joint_names
    assert RIGHT.others["left"] == LEFT.joint_names


def test_the_other_arm_stands_until_it_is_there_and_is_then_where_its_states_are():
    arm = SimulatedArm(LEFT)
    for _ in range(200):
        arm.step(STILL)
    assert right_joint(arm) == pytest.approx(0.0, abs=1e-4)
    for k in range(1, 101):
        arm.lead(RIGHT.joint_names, turned(k * 1e-3), [1.0, *[0.0] * 5])
        arm.step(STILL)
    assert right_joint(arm) == pytest.approx(0.101, abs=1e-4)  # a tick later
    for _ in range(50):
        arm.step(STILL)
    assert right_joint(arm) == pytest.approx(0.1, abs=1e-4)
    assert arm.observe().positions == pytest.approx(LEFT.home, abs=1e-4)


def test_it_pushes_this_arm():
    arm = SimulatedArm(LEFT)
    arm.lead(RIGHT.joint_names, turned(MEETS), [0.0] * 6)
    touches = []
    for _ in range(5):
        arm.step(STILL)
        touches += [contact.bodies for contact in arm.contacts()]
    assert touches
    assert all({body.partition("/")[0] for body in bodies} == {"left", "right"} for bodies in touches)


def test_plans_look_at_where_it_is():
    clearance = Clearance(LEFT, LEFT.load_model())
    between = [k for k, pair in enumerate(clearance.pairs) if any(body.startswith("right/") for body in pair.bodies)]
    clearance.place(LEFT.home)
    assert min(clearance.distance(k) for k in between) > 0.2
    clearance.surround(RIGHT.joint_names, turned(MEETS))
    clearance.place(LEFT.home)
    assert min(clearance.distance(k) for k in between) < 0
