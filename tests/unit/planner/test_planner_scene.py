"""The scene of the collision check: held joints and other robots follow their messages."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.codec import matrix_bytes
from robot.description import load_robot
from robot.motion_check import MotionCheck
from robot.shipped import DEFAULT_ROBOT_CONFIG
from services.common.cli import free_endpoint
from services.planner.other_robot import in_force
from services.planner.scene import Scene
from tests.unit.robot.small_arm import small_arm
from tools.drill.harness.waiting import eventually


@pytest.fixture
def bus() -> Iterator[Bus]:
    with Bus(open_session(listen=[free_endpoint()])) as bus:
        yield bus


def state(tick: int, held: dict[str, float]) -> m.State:
    still = {"positions": [1.57, 0.0, 0.0], "velocities": [0.0] * 3, "torques": [0.0] * 3, "saturated": [False] * 3}
    return m.State(run=1, tick=tick, time=tick / 1000, brake=False, applied_tick=tick, held=held, **still)


def test_held_joints_are_placed_by_states(bus: Bus, tmp_path: Path):
    config = small_arm(tmp_path, "[held]\ngrip = 0.0\n")
    motions = MotionCheck(config)
    clearance = motions.clearance
    scene, states = Scene(bus, config, motions), bus.publisher(topics.STATE)
    grip = clearance.data.joint("grip")

    def seen(value: float, message: m.State) -> bool:
        states.put(message)
        scene.update()
        return grip.qpos[0] == value

    assert grip.qpos[0] == 0.0
    opened = state(1, {"grip": 0.4, "shoulder": 0.1})
    assert eventually(lambda: seen(0.4, opened)), "the state's other joints are ignored"
    scene.update()
    assert grip.qpos[0] == 0.4, "it stays without a further state"
    clearance.place(config.home)
    finger = clearance.data.body("finger").xpos
    assert finger[0] == pytest.approx(-0.4, abs=2e-3)


LEFT, RIGHT = (load_robot(DEFAULT_ROBOT_CONFIG.with_name(f"{name}.toml")) for name in ("left", "right"))


def plan(goal_id: str, start: float, epoch: int, to: float) -> m.Plan:
    """Return a plan that moves the right arm's first joint from 0 to `to` rad in 1 s."""
    positions = np.tile(RIGHT.home, (1001, 1))
    positions[:, 0] = np.linspace(0, to, 1001)
    still = matrix_bytes(np.zeros((1001, 6)))
    limits = m.PlanLimits(positions=[], velocities=[], accelerations=[], jerks=[])
    frame: dict[str, Any] = {
        "goal_id": goal_id,
        "epoch": epoch,
        "joint_names": list(RIGHT.joint_names),
        "start_time": start,
    }
    samples: dict[str, Any] = {"positions": matrix_bytes(positions), "velocities": still, "accelerations": still}
    return m.Plan(**frame, dt=0.001, count=1001, hit_index=1000, **samples, primitive="wave", limits=limits)


def status(time: float, mode: m.Mode = "tracking") -> m.Status:
    still = m.Point(positions=[], velocities=[])
    cycle = m.Cycle(count=1, missed=0, on_time_ratio=1.0, late_us=m.Lateness(p50=1, p99=1, max=1), refused=0)
    points: dict[str, Any] = {"reference": still, "feedback": still, "error": still}
    return m.Status(time=time, mode=mode, epoch=1, goal_id=None, time_from_start=None, **points, cycle=cycle)


FIRST, CORRECTION, NEXT = plan("a", 4.0, 3, 0.5), plan("b", 4.5, 4, 0.6), plan("c", 5.2, 9, 0.7)


@pytest.mark.parametrize(
    ("plans", "time", "said", "ids"),
    [
        ([FIRST], 4.3, status(4.29), "a"),
        ([FIRST], 3.98, status(3.97, "holding"), "a"),  # accepted after the status
        ([FIRST], 4.3, status(4.29, "stopping"), ""),
        ([FIRST], 4.3, status(4.29, "fault"), ""),
        ([FIRST], 4.3, status(3.7), ""),  # an outdated status
        ([FIRST], 5.1, status(5.09, "holding"), ""),
        ([FIRST], 0.5, status(0.49), ""),  # of an earlier run
        ([FIRST, CORRECTION], 4.48, status(4.47), "ab"),
        ([FIRST, CORRECTION], 4.51, status(4.49), "b"),
        ([FIRST, CORRECTION, NEXT], 5.1, status(5.1, "holding"), "c"),
        ([], 4.0, status(4.0), ""),
    ],
)
def test_plans_in_force_follow_from_plans_and_status(plans: list[m.Plan], time: float, said: m.Status, ids: str):
    assert "".join(found.goal_id for found in in_force(plans, time, said)) == ids


def test_another_robots_plan_is_converted_to_this_robots_clock(bus: Bus):
    left, right = Bus(bus.session, "left"), Bus(bus.session, "right")
    motions = MotionCheck(LEFT)
    scene = Scene(left, LEFT, motions)
    still: dict[str, Any] = {
        "velocities": [0.0] * 6,
        "torques": [0.0] * 6,
        "saturated": [False] * 6,
        "brake": False,
        "run": 1,
    }
    mine = m.State(tick=12000, time=12.0, applied_tick=11999, positions=LEFT.home.tolist(), **still)
    others = m.State(tick=4300, time=4.3, applied_tick=4299, positions=[0.25, *RIGHT.home[1:].tolist()], **still)
    left.publisher(topics.STATE).put(mine)
    right.publisher(topics.STATE).put(others)
    right.publisher(topics.STATUS).put(status(4.29))
    right.publisher(topics.PLAN).put(replace(FIRST, positions=b""))  # malformed
    right.publisher(topics.PLAN).put(FIRST)
    assert eventually(lambda: scene.update() and bool(motions.others))
    (other,) = motions.others
    assert other.until == pytest.approx(12.7)
    assert other.sample(np.array([12.0, 12.2, 20.0]))[0, :, 0] == pytest.approx([0.15, 0.25, 0.5])
    assert not scene.update(), "nothing new"
    assert motions.others, "the plan is still in force"
    right.publisher(topics.STATUS).put(status(4.3, "stopping"))
    assert eventually(lambda: not (scene.update() or motions.others))
    assert motions.clearance.data.joint("right/joint_1").qpos[0] == 0.25
