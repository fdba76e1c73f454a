"""Fixtures of the controller: an arm that follows exactly, and loops on a fake bus."""

from collections.abc import Callable, Iterator

import pytest

from protocol import messages as m
from robot.description import RobotConfig
from services.controller.core import Controller
from tests.unit.controller.perfect_arm import ROBOT, PerfectArm
from tests.unit.controller.running_loop import RunningLoop
from tests.unit.controller.stand_ins import CONFIG


@pytest.fixture
def arm() -> PerfectArm:
    """Return an arm whose first ten states have been answered."""
    arm = PerfectArm(Controller(ROBOT))
    arm.turn(10)
    return arm


@pytest.fixture
def start_loop() -> Iterator[Callable[..., RunningLoop]]:
    """Start loops, whose threads end with the test."""
    made: list[RunningLoop] = []

    def make(
        arm_clock: m.Clock = "realtime", config: RobotConfig = CONFIG, clock: Callable[[], int] | None = None
    ) -> RunningLoop:
        made.append(RunningLoop(arm_clock, config, clock))
        return made[-1]

    yield make
    for running in made:
        running.close()


@pytest.fixture
def running(start_loop: Callable[..., RunningLoop]) -> RunningLoop:
    """A loop in real time."""
    return start_loop()
