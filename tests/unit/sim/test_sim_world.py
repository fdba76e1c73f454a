"""Several arms in one simulation: a common tick and ball, and contacts that act on both arms."""

import logging
import threading
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from setpoints import accelerating

from protocol import messages as m
from protocol import topics
from protocol.codec import encode
from robot.description import RobotConfig, load_robot
from robot.schema import RobotError
from robot.shipped import DEFAULT_ROBOT_CONFIG
from services.common.robot_side.clocks import keep_time
from services.sim.arm import SimulatedArm
from services.sim.loop import SimLoop, run_stepped
from services.sim.world import World

NEAR, FAR, LEFT, RIGHT = (
    load_robot(DEFAULT_ROBOT_CONFIG.with_name(f"{name}.toml")) for name in ("near", "far", "left", "right")
)
STILL = accelerating(np.zeros(6))
NO_BUS = SimpleNamespace(
    publisher=lambda *_, **__: SimpleNamespace(put=lambda _: None), take_puts=list, session=None, robot=""
)


def arms_of(*configs: RobotConfig) -> list[SimulatedArm]:
    world = World(configs)
    return [SimulatedArm(config, world=world) for config in configs]


def step(*arms: SimulatedArm, ticks: int = 1) -> None:
    for _ in range(ticks):
        for arm in arms:
            arm.step(STILL)


def test_the_simulation_steps_once_every_arm_has_its_setpoint():
    near, far = arms_of(NEAR, FAR)
    near.step(STILL)
    near.step(STILL)
    assert (near.observe().tick, far.observe().tick) == (0, 0)
    far.step(STILL)
    assert (near.observe().tick, far.observe().tick) == (1, 1)


def test_an_arm_moves_with_another_as_it_does_alone():
    swing = accelerating(np.array([8.0, -3.0, 4.0, 5.0, -5.0, 6.0]))
    near, far = arms_of(NEAR, FAR)
    (alone,) = arms_of(NEAR)
    for _ in range(150):
        for arm in (near, alone):
            arm.step(swing)
        far.step(STILL)
    assert near.observe().positions == pytest.approx(alone.observe().positions, abs=1e-9)
    assert near.observe().positions != pytest.approx(NEAR.home, abs=0.02)
    assert far.observe().positions == pytest.approx(FAR.home, abs=1e-6)


def test_joints_of_another_simulated_arm_are_not_held():
    near, far = arms_of(NEAR, FAR)
    assert (near.observe().held, far.observe().held) == ({}, {})


def test_a_new_run_of_one_arm_does_not_move_the_other():
    near, far = arms_of(NEAR, FAR)
    for _ in range(100):
        near.step(STILL)
        far.step(accelerating(np.full(6, 5.0)))
    moved = far.observe().positions
    near.reset(ball=m.Ball(position=(0.5, 0.0, 1.0), velocity=(0.0, 0.0, 1.0)))
    step(near, far)
    assert (near.observe().tick, far.observe().tick) == (1, 101)
    assert far.observe().positions == pytest.approx(moved, abs=0.01)
    seen = far.ball()
    assert seen == near.ball()
    assert seen is not None
    assert seen.position == pytest.approx([0.5, 0.0, 1.001], abs=1e-4)


def test_a_contact_moves_both_arms():
    """In two separate simulations neither arm would move the other."""
    left, right = arms_of(LEFT, RIGHT)
    right.reset(positions=[-0.8, *RIGHT.home[1:].tolist()])
    step(left, right, ticks=5)
    for arm in (left, right):
        assert np.abs(arm.observe().velocities).max() > 0.02


@pytest.mark.parametrize(
    ("others", "says"),
    [
        ((NEAR, NEAR), "two robots of one simulation are called 'near'"),
        ((NEAR, LEFT), "near and left have not the same model"),
        ((NEAR, replace(FAR, rate_hz=500)), "near and far have not the same rate_hz"),
        ((NEAR, replace(FAR, ball=None)), "near and far have not the same \\[ball\\]"),
        ((NEAR, replace(NEAR, name="other")), "name the same joint"),
    ],
)
def test_incompatible_robots_of_one_simulation_are_refused(others: tuple[RobotConfig, ...], says: str):
    with pytest.raises(RobotError, match=says):
        World(others)


class HoldingController:
    """A controller that answers every state with a command to hold the home pose."""

    def __init__(self, loop: SimLoop) -> None:
        self._loop = loop

    def take(self, _: float = 0.0) -> bytes | None:
        """Return the command for the present tick, or None if it has been answered."""
        loop, tick = self._loop, self._loop.backend.observe().tick
        if loop.drive.answered_tick >= tick:
            return None
        home, still = loop.config.home.tolist(), [0.0] * loop.config.joint_count
        return encode(
            m.Command(
                run=loop.drive.run,
                tick=tick,
                source="test",
                accelerations=still,
                positions=home,
                velocities=still,
                goal_id=None,
            )
        )


def loops_of(clock: m.Clock, answering: int) -> list[SimLoop]:
    """Return the loops of both arms; the first `answering` of them have a controller."""
    world = World([NEAR, FAR])
    log = logging.getLogger("sim")
    loops = [SimLoop(NO_BUS, config, clock, 0, log, world) for config in (NEAR, FAR)]  # type: ignore[arg-type]
    for loop in loops[:answering]:
        loop.commands = HoldingController(loop)  # type: ignore[assignment]
        loop.controller.see("", True)
    for loop in loops[answering:]:
        loop.commands = SimpleNamespace(take=lambda *_: None)  # type: ignore[assignment]
    return loops


def until(loops: list[SimLoop], done: Callable[[], bool]) -> threading.Event:
    """Return an event that is set once `done` returns true; it is called after each round of the loops."""
    stopping = threading.Event()
    attend = loops[-1].attend

    def look(wait_s: float = 0.0) -> None:
        attend(0.0)
        if done():
            stopping.set()

    loops[-1].attend = look  # type: ignore[method-assign]
    return stopping


@pytest.mark.parametrize("answering", [1, 2])
def test_a_step_request_to_one_arm_steps_both(answering: int):
    loops = loops_of("stepped", answering)
    answers: list[m.Stepped] = []
    query = SimpleNamespace(reply=answers.append)
    loops[0].handlers[topics.SIM_STEP.key](query, m.Step(ticks=5))  # type: ignore[arg-type]
    run_stepped(loops, until(loops, lambda: bool(answers)))
    assert [answer.tick for answer in answers] == [5]
    assert [loop.backend.observe().tick for loop in loops] == [5, 5]


@pytest.mark.parametrize("clock", ["paced", "realtime"])
def test_both_clocks_step_both_arms(clock: m.Clock):
    loops = loops_of(clock, 2)
    keep_time(loops, until(loops, lambda: loops[0].backend.observe().tick >= 20), pace=0.5)
    assert [loop.backend.observe().tick for loop in loops] == [20, 20]
    assert all(loop.drive.answered_tick >= 19 for loop in loops)
