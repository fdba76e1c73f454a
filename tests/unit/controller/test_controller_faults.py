"""Faults of the arm: a large tracking error, its brake, and conditions in which it follows no commands."""

import dataclasses

import numpy as np
import pytest

from protocol import messages as m
from protocol.errors import Refusal
from services.controller.core import Controller
from services.controller.modes import Mode
from tests.unit.controller.perfect_arm import ROBOT, TICK, PerfectArm, execute, refused, trajectory


def test_a_brake_that_does_not_let_go_is_a_fault_again(arm: PerfectArm):
    """Noise may keep the brake on; no goal may run while the arm brakes."""
    controller = arm.controller
    arm.brake = True
    arm.turn(1)
    controller.reset()
    arm.turn(ROBOT.silence_ticks)
    assert controller.mode is Mode.HOLDING
    arm.turn(1)
    assert controller.mode is Mode.FAULT
    assert "still brakes" in (controller.fault or "")


def test_a_large_tracking_error_is_a_fault(arm: PerfectArm):
    """The arm stops, the goal is aborted, and the fault lasts until a reset at rest."""
    controller = arm.controller
    execute(arm, trajectory(controller, 30))
    arm.turn(40)
    pushed = arm.positions.copy()
    pushed[2] += ROBOT.max_tracking_error + 0.01
    controller.answer(arm.state(positions=pushed.tolist()), 0)
    arm.tick += 1
    assert controller.mode is Mode.FAULT
    assert "joint_3" in (controller.fault or "")
    assert controller.ledger.result("goal").outcome == "aborted"
    assert refused(arm, trajectory(controller, arm.tick + 5, "next")).code == "fault"
    with pytest.raises(Refusal) as caught:
        controller.reset()
    assert caught.value.code == "busy"
    arm.turn(600)
    assert controller.mode is Mode.FAULT
    assert controller.reset() == m.ModeReply(mode="holding")
    assert controller.fault is None
    assert controller.reference(m.ReferenceRequest(lead=0.0)).positions == pytest.approx(arm.positions, abs=1e-3)


def test_a_braking_arm_is_a_fault(arm: PerfectArm):
    """It is one at the controller's start too, and once per braking: after a reset it is not repeated."""
    for controller in (arm.controller, Controller(ROBOT)):
        controller.answer(arm.state(brake=True), 0)
        assert controller.mode is Mode.FAULT
        controller.reset()
        assert controller.answer(arm.state(brake=True, tick=arm.tick + 1), 0) is not None
        assert controller.mode is Mode.HOLDING
        controller.answer(arm.state(brake=False, tick=arm.tick + 2), 0)
        controller.answer(arm.state(brake=True, tick=arm.tick + 3), 0)
        assert controller.mode is Mode.FAULT
        controller.answer(arm.state(brake=True, run=2, tick=0), 0)
        assert controller.mode is Mode.FAULT


@pytest.mark.parametrize(
    ("condition", "words"),
    [
        ("braking", "the arm braked by itself"),
        ("reflex", "the arm stopped itself in a reflex"),
        ("user_stopped", "the arm was stopped by its user"),
        ("guiding", "the arm is guided by hand"),
        ("not_ready", "the arm is not ready"),
    ],
)
def test_an_arm_that_follows_no_commands_is_a_fault(arm: PerfectArm, condition: m.Condition, words: str):
    """The fault quotes its reason; goals are refused with it, after a reset too, until the arm is ready."""
    execute(arm, trajectory(arm.controller, 30))
    arm.turn(50)
    assert arm.controller.answer(arm.state(condition=condition, reason="joint_2 says so"), 0) is not None
    assert arm.controller.fault == f"{words}: joint_2 says so"
    assert arm.controller.ledger.result("goal").outcome == "aborted"
    arm.tick += 1
    arm.velocities[:] = 0.0
    assert arm.controller.answer(arm.state(condition=condition, reason="joint_2 says so"), 0) is not None
    cure = "`reset`" if condition == "braking" else "`recover`"
    assert cure in refused(arm, trajectory(arm.controller, 200, "meanwhile")).message
    if condition == "braking":
        assert arm.controller.reset().mode == "holding"
    else:
        with pytest.raises(Refusal) as caught:
            arm.controller.reset()
        assert caught.value.code == "fault"
        assert "`recover`" in caught.value.message
    refusal = refused(arm, trajectory(arm.controller, 200, "another"))
    assert (refusal.code, refusal.detail["fault"]) == ("fault", f"{words}: joint_2 says so")
    arm.run, arm.tick = 2, 0
    arm.turn(10)
    execute(arm, trajectory(arm.controller, 30, "after"))


def test_an_older_robot_side_reports_only_its_brake(arm: PerfectArm):
    """This is taken as the condition "braking" without a reason."""
    arm.brake = True
    arm.turn(1)
    assert arm.controller.fault == "the arm braked by itself"


@pytest.mark.parametrize("speed", [0.0, 2.0])
def test_the_reference_gives_way_to_an_arm_that_is_kept_from_it(arm: PerfectArm, speed: float):
    """It restarts where the arm is, stops inside the limits, and does so again while the arm is pushed."""
    controller = arm.controller
    execute(arm, trajectory(controller, 30))
    arm.turn(40)
    for _ in range(2):
        arm.positions[2] += ROBOT.max_tracking_error + 0.01
        arm.velocities[2] = speed
        measured = arm.state()
        arm.turn(1)
        command = arm.commands[-1]
        assert (command.positions, command.velocities) == (measured.positions, measured.velocities)
        began = len(arm.commands)
        arm.turn(400)
        velocities = np.array([command.velocities for command in arm.commands[began - 1 :]])
        accelerations = np.diff(velocities, axis=0) / TICK
        assert not velocities[-1].any()
        assert np.all(np.abs(accelerations) <= ROBOT.limits.accelerations + 1e-9)
        assert np.all(np.abs(np.diff(accelerations, axis=0)) / TICK <= ROBOT.limits.jerks + 1e-6)


def test_with_on_fault_stop_the_reference_ends_its_own_way():
    config = dataclasses.replace(ROBOT, on_fault="stop")
    arm = PerfectArm(Controller(config))
    arm.turn(10)
    arm.positions[2] += config.max_tracking_error + 0.01
    arm.turn(1)
    assert arm.controller.fault
    assert arm.commands[-1].positions == ROBOT.home.tolist()
