"""The rally's own check of what the arm was commanded and did."""

import numpy as np
import pytest

from protocol import messages as m
from robot.description import load_robot
from tools.rally.limit_monitor import LimitReport, check

ROBOT = load_robot()
JOINTS, TICK = ROBOT.joint_count, ROBOT.tick


def commanded_and_did(accelerations: np.ndarray, velocity_error: float = 0.0) -> tuple[list[m.Command], list[m.State]]:
    """Commands that accelerate the first joint from home, one a tick, and states that follow them."""
    commands, states = [], []
    q, v = ROBOT.home.copy(), np.zeros(JOINTS)
    for tick, acceleration in enumerate(accelerations):
        ahead = np.zeros(JOINTS)
        ahead[0] = acceleration
        positions, velocities = q.tolist(), v.tolist()
        commands.append(
            m.Command(
                run=1,
                tick=tick,
                source="",
                accelerations=ahead.tolist(),
                positions=positions,
                velocities=velocities,
                goal_id=None,
                feedforward=ahead.tolist(),
            )
        )
        measured = [v[0] + velocity_error, *velocities[1:]]
        nothing = [0.0] * JOINTS
        states.append(
            m.State(
                run=1,
                tick=tick,
                time=tick * TICK,
                positions=positions,
                velocities=measured,
                torques=nothing,
                saturated=[False] * JOINTS,
                brake=False,
                applied_tick=tick,
            )
        )
        q = q + TICK * v + TICK**2 / 2 * ahead
        v = v + TICK * ahead
    return commands, states


def found(accelerations: np.ndarray, touches: tuple[float, ...] = (), velocity_error: float = 0.0) -> LimitReport:
    commands, states = commanded_and_did(accelerations, velocity_error)
    return check(commands, states, touches, ROBOT)


def smooth(fraction: float) -> np.ndarray:
    """Accelerations (n,) that begin and end at 0 and reach a fraction of the first joint's limit slowly."""
    rise = np.minimum(1.0, np.arange(100) * TICK * ROBOT.limits.jerks[0] / ROBOT.limits.accelerations[0] / 2)
    return fraction * ROBOT.limits.accelerations[0] * np.concatenate([rise, rise[::-1]])


def test_a_motion_inside_the_limits_is_none_and_its_closest_limit_is_named():
    findings = found(smooth(0.2))
    assert (findings.ticks, findings.unseen, findings.violations) == (200, 0, 0)
    assert 0 < findings.closest.fraction <= 1


def test_an_acceleration_beyond_the_limit_is_counted_and_named():
    findings = found(smooth(1.1))
    assert findings.violations > 0
    assert (findings.worst.joint, findings.worst.quantity) in {
        (ROBOT.joint_names[0], "acceleration"),
        (ROBOT.joint_names[0], "jerk"),
        (ROBOT.joint_names[0], "velocity"),
    }
    assert findings.worst.fraction > 1


def test_a_jump_of_the_acceleration_passes_the_jerk_limit():
    step = np.zeros(20)
    step[10:] = 2 * ROBOT.limits.jerks[0] * TICK
    findings = found(step)
    assert findings.violations == 1
    assert findings.worst.quantity == "jerk"
    assert findings.worst.fraction == pytest.approx(2.0)


def test_what_the_ball_did_to_the_arm_is_counted_apart():
    fast = 1.5 * ROBOT.limits.velocities[0]
    thrown, alone = found(np.zeros(100), (0.0,), fast), found(np.zeros(100), (), fast)
    assert (thrown.violations, alone.violations) == (0, 100)
    assert thrown.recoil.fraction == pytest.approx(1.5)


def test_ticks_that_were_not_received_are_counted_and_their_jerk_is_not_made_up():
    commands, states = commanded_and_did(smooth(0.2))
    findings = check(commands[:50] + commands[60:], states, (), ROBOT)
    assert (findings.unseen, findings.violations) == (10, 0)
