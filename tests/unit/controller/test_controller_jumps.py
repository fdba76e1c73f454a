"""Commands that do not jump: after a restart in motion, with a delayed arm, and for an arm that others move."""

import msgspec
import numpy as np
import pytest

from protocol import messages as m
from services.controller.core import Controller
from services.controller.modes import Mode
from tests.golden.examples import EXAMPLES
from tests.unit.controller.perfect_arm import ROBOT, TICK, PerfectArm, execute, refused, trajectory

LIMITS = ROBOT.limits
OTHERS: tuple[m.Condition, ...] = "reflex", "user_stopped", "guiding", "not_ready"
"""Conditions that only `recover` ends; an arm may still become ready by itself."""


def an_arm(delay: int = 0, clock: m.Clock = "realtime") -> PerfectArm:
    """Return an arm that applies commands `delay` ticks late, its first ten states answered."""
    arm = PerfectArm(Controller(ROBOT))
    description = EXAMPLES["Description"]
    assert isinstance(description, m.Description)
    arm.controller.meet(msgspec.structs.replace(description, clock=clock, delay_ticks=delay))
    arm.turn(10)
    return arm


def check_smooth(commands: list[m.Command]) -> None:
    """Check that the commanded reference keeps the jerk limit, and that positions are the integral of velocities."""
    ahead = [command.next for command in commands if command.next]
    positions, velocities = (
        np.array([getattr(point, name) for point in ahead]) for name in ("positions", "velocities")
    )
    accelerations = np.array([command.feedforward for command in commands])
    assert np.all(np.abs(np.diff(accelerations, axis=0)) <= LIMITS.jerks * TICK * (1 + 1e-6))
    gaps = np.diff(positions, axis=0) - (velocities[1:] + velocities[:-1]) / 2 * TICK
    assert np.all(np.abs(gaps) <= LIMITS.jerks * TICK**3 / 6 + 1e-12)


@pytest.mark.parametrize("speed", [1.5, -6.0])
def test_a_controller_that_finds_the_arm_in_motion_stops_it_inside_the_limits(speed: float):
    """The clock `stepped` stands still while a killed controller is replaced, so the arm has not braked by itself."""
    arm = PerfectArm(Controller(ROBOT))
    arm.velocities[0] = speed
    arm.turn(1)
    assert arm.controller.mode is Mode.STOPPING
    arm.turn(500)
    check_smooth(arm.commands)
    accelerations = np.array([command.accelerations for command in arm.commands])
    assert np.all(np.abs(accelerations) <= LIMITS.accelerations)
    assert arm.controller.mode is Mode.HOLDING
    assert np.abs(arm.velocities).max() < 1e-3


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_stop_begins_where_no_command_has_been_yet(delay: int):
    """An arm with a delay has commands for the next ticks already; another reference for them would be a jump."""
    arm = an_arm(delay)
    execute(arm, trajectory(arm.controller, 30))
    arm.turn(100)
    arm.controller.cancel(m.Cancel())
    arm.turn(300)
    check_smooth(arm.commands)
    assert not any(arm.commands[-1].velocities)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_motion_that_begins_in_commands_already_sent_is_late(delay: int):
    arm = an_arm(delay)
    assert refused(arm, trajectory(arm.controller, 9 + delay)).code == "late"
    assert execute(arm, trajectory(arm.controller, 10 + delay)).goal_id == "goal"


@pytest.mark.parametrize("condition", OTHERS)
def test_the_reference_follows_an_arm_that_others_move(condition: m.Condition):
    """Once the arm is ready again, also by itself, it is not pulled back to where it was."""
    arm = an_arm()
    for _ in range(100):
        arm.positions[0] += 1e-3
        assert arm.controller.answer(arm.state(condition=condition), 0) is not None
        arm.tick += 1
    arm.turn(1)
    assert np.abs(arm.commands[-1].accelerations).max() < 1e-9
    assert arm.controller.fault


@pytest.mark.parametrize("condition", OTHERS)
def test_goals_are_refused_as_soon_as_the_condition_is_published(condition: m.Condition):
    """The arm publishes the state of the present tick again when its condition changes between two ticks."""
    arm = an_arm()
    planned = trajectory(arm.controller, 30)
    arm.tick -= 1
    assert arm.controller.answer(arm.state(condition=condition), 0) is None
    assert refused(arm, planned).code == "fault"


@pytest.mark.parametrize("condition", OTHERS)
def test_a_malformed_state_of_the_present_tick_is_ignored(condition: m.Condition):
    """It has too few joints for the reference to follow it; it must not end the controller."""
    arm = an_arm()
    arm.tick -= 1
    short = arm.state(condition=condition, positions=[0.0], velocities=[0.0])
    assert arm.controller.answer(short, 0) is None
    assert arm.controller.fault is None
    arm.tick += 1
    arm.turn(1)


def test_with_the_stepped_clock_a_condition_at_tick_0_begins_no_run():
    """Another state of tick 0 begins a run with the same number, unless the arm is no longer ready."""
    arm = an_arm(clock="stepped")
    arm.run, arm.tick = 2, 0
    arm.turn(1)
    arm.tick = 0
    assert arm.controller.answer(arm.state(condition="guiding"), 0) is None
    assert arm.controller.fault == "the arm is guided by hand"
    assert arm.controller.answer(arm.state(), 0) is not None
    assert arm.controller.fault is None
