"""A controller that starts while the arm moves: the commanded acceleration does not jump."""

from collections import deque

import msgspec
import numpy as np
import pytest

from examples.stand_in_driver import StandIn
from protocol import messages as m
from services.common.robot_side.backend import Setpoint
from services.common.robot_side.drive import NEVER, Drive
from services.common.robot_side.messages import state_message
from services.controller.core import AT_REST, Controller
from services.controller.modes import Mode
from tests.closed_loop import ClosedLoop
from tests.golden.examples import EXAMPLES
from tests.unit.controller.perfect_arm import ROBOT

STEP = ROBOT.limits.jerks * ROBOT.tick * (1 + 1e-6)
"""Largest change of an acceleration in a tick, (J,), rad/s²."""
MOTION = {"joint_1": 0.5, "joint_2": -0.3, "joint_4": 0.4}
MOTION_S = 0.2
INSTANTS = range(5, round(MOTION_S * ROBOT.rate_hz), 13)
"""Ticks of the motion at which its controller ends."""


class IdealLoop(ClosedLoop):
    """A controller and an arm that follows setpoints exactly, `delay` ticks late.

    Attributes:
        given: Setpoints of the arm, one a tick.
        known: Whether the arm publishes its accelerations.
    """

    def __init__(self, delay: int = 0, clock: m.Clock = "realtime", known: bool = True) -> None:
        self.config, self.arm, self.drive = ROBOT, StandIn(ROBOT), Drive(ROBOT)
        self.given: list[Setpoint] = []
        self.known = known
        description = EXAMPLES["Description"]
        assert isinstance(description, m.Description)
        self._description = msgspec.structs.replace(description, clock=clock, delay_ticks=delay)
        self._waiting = deque([self.drive.setpoint(ROBOT.home, np.zeros(ROBOT.joint_count))] * delay)
        self.start_controller()

    def start_controller(self) -> None:
        """Replace the controller."""
        self.controller = Controller(ROBOT)
        self.controller.meet(self._description)

    def play(self, ticks: int, answered: bool = True) -> None:
        """Step the arm, with or without the controller's answers."""
        for _ in range(ticks):
            now = self.arm.observe()
            state = state_message(now, self.drive, NEVER)
            if not self.known:
                state = msgspec.structs.replace(state, accelerations=None)
            if answered and (command := self.controller.answer(state, 0)):
                self.drive.take(command, now.tick)
            self.given.append(self.drive.setpoint(now.positions, now.velocities))
            self._waiting.append(self.given[-1])
            self.arm.step(self._waiting.popleft())

    def restart(self, instant: int, silence: int) -> None:
        """Replace the controller at `instant` (ticks) of a motion, after a silence, and play until the arm rests."""
        self.play(30)
        self.move(MOTION, MOTION_S)
        self.play(instant)
        self.play(silence, answered=False)
        self.start_controller()
        self.play(200)

    def check_rest(self, name: str) -> None:
        """Check that the accelerations called `name` did not jump, and that the arm rests."""
        values = [getattr(setpoint, name) for setpoint in self.given]
        assert np.all(np.abs(np.diff(values, axis=0)) <= STEP)
        assert np.abs(self.arm.observe().velocities).max() < AT_REST


@pytest.mark.parametrize("silence", [0, 1, 7, 19, 20, 45])
def test_the_new_controller_continues_the_acceleration(silence: int):
    """The arm repeats the last acceleration without commands, and brakes after 20 ticks."""
    for instant in INSTANTS:
        loop = IdealLoop()
        loop.restart(instant, silence)
        loop.check_rest("accelerations")


@pytest.mark.parametrize("delay", [1, 4])
def test_an_arm_with_a_delay_has_its_next_setpoints_already(delay: int):
    """Feedback comes on top, because the arm still follows older setpoints."""
    for instant in INSTANTS:
        loop = IdealLoop(delay)
        loop.restart(instant, 2)
        loop.check_rest("feedforward")


@pytest.mark.parametrize("silence", [0, 7])
def test_in_real_time_an_arm_of_unknown_acceleration_is_left_to_its_own_brake(silence: int):
    """Older drivers do not publish it."""
    for instant in INSTANTS:
        loop = IdealLoop(known=False)
        loop.restart(instant, silence)
        loop.check_rest("accelerations")


@pytest.mark.parametrize("clock", ["paced", "stepped"])
def test_with_other_clocks_an_arm_of_unknown_acceleration_is_stopped_at_once(clock: m.Clock):
    """It waits for the answer, the clock stepped for ever."""
    loop = IdealLoop(clock=clock, known=False)
    loop.restart(70, 0)
    assert np.abs(loop.arm.observe().velocities).max() < AT_REST
    assert loop.controller.mode is Mode.HOLDING
