"""The conditions of the arm that are faults of the controller."""

import pytest

from services.controller.conditions import ArmCondition
from tests.unit.controller.stand_ins import state


def test_an_arm_that_is_ready_is_no_fault():
    condition = ArmCondition()
    assert condition.update(state(0), in_fault=False) is None
    assert condition.now == "ready"


@pytest.mark.parametrize("reason", ["", "joint 3 was touched"])
def test_a_condition_other_than_ready_is_a_fault_once(reason: str):
    """The fault quotes the arm's reason."""
    condition = ArmCondition()
    faults = [condition.update(state(tick, condition="reflex", reason=reason), in_fault=tick > 0) for tick in range(3)]
    sentence = "the arm stopped itself in a reflex" + (f": {reason}" if reason else "")
    assert faults == [sentence, None, None]
    assert condition.sentence == sentence


def test_an_older_arm_publishes_only_its_brake():
    condition = ArmCondition()
    assert condition.update(state(0, brake=True), in_fault=False) == "the arm braked by itself"
    assert condition.now == "braking"


def test_a_brake_must_be_released_in_time():
    """After a reset it may be applied until the tick by which its release is expected."""
    condition = ArmCondition()
    condition.update(state(0, brake=True), in_fault=False)
    condition.expect_release(3)
    faults = [condition.update(state(tick, brake=True), in_fault=False) for tick in (1, 2, 3, 4)]
    assert faults[:3] == [None, None, None]
    assert "still brakes" in (faults[3] or "")
    assert condition.update(state(5, brake=True), in_fault=True) is None
    assert condition.update(state(6), in_fault=True) is None
    assert condition.now == "ready"
