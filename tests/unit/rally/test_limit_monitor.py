"""The rally's independent check of commands and measured states against limits."""

import numpy as np
import pytest

from protocol import messages as m
from robot.description import load_robot
from tools.rally.limit_monitor import LimitReport, check

ROBOT = load_robot()
JOINTS, TICK = ROBOT.joint_count, ROBOT.tick


def commands_and_states(
    accelerations: np.ndarray, velocity_error: float = 0.0
) -> tuple[list[m.Command], list[m.State]]:
    """Return one command a tick that accelerates the first joint from home, and states that follow exactly."""
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


def findings_of(accelerations: np.ndarray, touches: tuple[float, ...] = (), velocity_error: float = 0.0) -> LimitReport:
    commands, states = commands_and_states(accelerations, velocity_error)
    return check(commands, states, touches, ROBOT)


def smooth(fraction: float, rise: int = 100) -> np.ndarray:
    """Return accelerations (2·rise,), rad/s², that rise to `fraction` of the first joint's limit, and fall again.

    The jerk is `fraction`/2 of its limit.
    """
    slope = TICK * ROBOT.limits.jerks[0] / ROBOT.limits.accelerations[0] / 2
    rising = np.minimum(1.0, np.arange(rise) * slope)
    return fraction * ROBOT.limits.accelerations[0] * np.concatenate([rising, rising[::-1]])


def test_a_motion_inside_the_limits_has_no_violations_and_names_its_closest_limit():
    findings = findings_of(smooth(0.2))
    assert (findings.ticks, findings.unseen, findings.violations) == (200, 0, 0)
    assert 0 < findings.closest.fraction <= 1


def test_an_acceleration_beyond_the_limit_is_counted_and_reported():
    findings = findings_of(smooth(1.1, rise=41))
    assert findings.violations > 0
    assert (findings.worst.joint, findings.worst.quantity) == (ROBOT.joint_names[0], "acceleration")
    assert findings.worst.fraction == pytest.approx(1.1)


def test_a_step_of_the_acceleration_violates_the_jerk_limit():
    step = np.zeros(20)
    step[10:] = 2 * ROBOT.limits.jerks[0] * TICK
    findings = findings_of(step)
    assert findings.violations == 1
    assert findings.worst.quantity == "jerk"
    assert findings.worst.fraction == pytest.approx(2.0)


def test_recoil_is_not_counted_as_a_violation():
    fast = 1.5 * ROBOT.limits.velocities[0]
    thrown, alone = findings_of(np.zeros(100), (0.0,), fast), findings_of(np.zeros(100), (), fast)
    assert (thrown.violations, alone.violations) == (0, 100)
    assert thrown.recoil.fraction == pytest.approx(1.5)


def test_missing_ticks_are_counted_and_cause_no_jerk_violation():
    commands, states = commands_and_states(smooth(0.2))
    findings = check(commands[:50] + commands[60:], states, (), ROBOT)
    assert (findings.unseen, findings.violations) == (10, 0)
