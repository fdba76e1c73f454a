"""What moves in the robot's model without the planner: the check in space must know where it is."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from robot.clearance import Clearance
from services.common.cli import free_endpoint
from services.planner.scene import Scene
from tests.unit.robot.small_arm import small_arm


@pytest.fixture
def bus() -> Iterator[Bus]:
    with Bus(open_session(listen=[free_endpoint()])) as bus:
        yield bus


def state(tick: int, held: dict[str, float]) -> m.State:
    still = {"positions": [1.57, 0.0, 0.0], "velocities": [0.0] * 3, "torques": [0.0] * 3, "saturated": [False] * 3}
    return m.State(run=1, tick=tick, time=tick / 1000, brake=False, applied_tick=tick, held=held, **still)


def test_a_gripper_is_checked_where_it_was_opened_to(bus: Bus, tmp_path: Path):
    config = small_arm(tmp_path, "[held]\ngrip = 0.0\n")
    clearance = Clearance(config, config.load_model())
    scene, states = Scene(bus, config, clearance), bus.publisher(topics.STATE)
    grip = clearance.data.joint("grip")

    def seen(value: float, message: m.State) -> bool:
        for _ in range(100):
            states.put(message)
            time.sleep(0.01)
            scene.look()
            if grip.qpos[0] == value:
                return True
        return False

    assert grip.qpos[0] == 0.0
    assert seen(0.4, state(1, {"grip": 0.4, "shoulder": 0.1})), "the arm's own joints are the plan's"
    scene.look()
    assert grip.qpos[0] == 0.4, "without news it stays"
    clearance.place(config.home)
    finger = clearance.data.body("finger").xpos
    assert finger[0] == pytest.approx(-0.4, abs=2e-3)
