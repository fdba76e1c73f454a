"""Two arms of one scene on one bus: each receives where the other one is, and plans around it."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from client import Arm, Refusal, connect
from protocol import topics
from services.common.cell import running_cell
from services.common.cli import Options, free_endpoint
from tests.cores import LOOP_CORE
from tools.drill.harness.waiting import PATIENCE_S, eventually

ROBOTS = Path(__file__).parents[2] / "deploy" / "robots"
SERVICES = ["sim", "planner", "controller"]
HOME = np.array([0.0, 0.52, 0.82, -0.2, 0.0, 0.09])
TURN = 0.8
"""Turn of the left arm's first joint that meets the right arm's racket at home, rad."""


@pytest.fixture(scope="module")
def arms() -> Iterator[tuple[Arm, Arm]]:
    endpoint, flags = free_endpoint(), {"clock": "stepped"}
    left = Options(robot_config=ROBOTS / "left.toml", listen=(endpoint,), loop_core=LOOP_CORE)
    right = dataclasses.replace(left, robot_config=ROBOTS / "right.toml", listen=(), connect=(endpoint,))
    with (
        running_cell(left, flags, SERVICES, quiet=True),
        running_cell(right, flags, SERVICES, quiet=True),
        connect(endpoint, robot="left") as one,
        connect(endpoint, robot="right") as other,
    ):
        for arm in (one, other):
            times = np.linspace(0, 1, 101)
            movement = np.zeros((101, 6))
            movement[:, 0] = TURN * (10 * times**3 - 15 * times**4 + 6 * times**5)
            arm.learn("turn", times=times, positions=HOME + movement)
        yield one, other


def test_each_arm_is_where_the_other_sees_it_and_plans_around_it(arms: tuple[Arm, Arm]):
    left, right = arms
    left.step(1)
    right.step(1)
    with pytest.raises(Refusal) as caught:
        left.goal("turn", duration=1.0)
    assert caught.value.code == "collision"
    bodies = caught.value.detail["body"], caught.value.detail["other"]
    assert {body.partition("/")[0] for body in bodies} == {"left", "right"}
    turned = right.goal("turn", duration=1.0)
    right.step(1200)
    assert turned.result().outcome == "succeeded"
    with left.stream(topics.SCENE) as scenes:
        left.step(40)
        scenes.take(PATIENCE_S)
        seen = scenes.take(PATIENCE_S).joints["right/joint_1"]
    assert seen == pytest.approx([TURN], abs=1e-6)
    left.goal("turn", duration=1.0)
    left.step(1200)
    assert left.state().positions[0] == pytest.approx(TURN, abs=1e-5)


def test_plans_that_cross_are_refused_though_each_start_is_clear(arms: tuple[Arm, Arm]):
    left, right = arms
    home, away = HOME.tolist(), [TURN, *HOME[1:].tolist()]
    for positions, arm in ((away, right), (home, left)):
        arm.goal("turn", positions=positions, duration=1.0)
        arm.step(1200)
    assert left.plan("turn", positions=away, duration=1.0).report.checked == "all"
    back = right.goal("turn", positions=home, duration=1.0)  # its plan is published but has not begun

    def refused() -> bool:
        try:
            left.plan("turn", positions=away, duration=1.0)
        except Refusal as refusal:
            return refusal.code == "collision" and "when the other robot's motion has ended" in str(refusal)
        return False

    assert eventually(refused)
    with pytest.raises(Refusal, match="nearer than the margin"):
        left.goal("turn", positions=away, duration=1.0)
    right.cancel()
    right.step(100)
    assert back.result().outcome == "canceled"
    assert eventually(lambda: not refused())  # the right controller's status reports it to the left planner
    assert left.plan("turn", positions=away, duration=1.0).report.checked == "all"
