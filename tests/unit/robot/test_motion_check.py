"""Checks of motions for collisions and torques, on an arm for which both can be computed by hand."""

from pathlib import Path

import numpy as np
import pytest

from motion.errors import MotionError
from robot.motion_check import Collides, MotionCheck
from robot.torque_check import TorqueExceeded
from tests.unit.robot.small_arm import small_arm, straight

NORTH, EAST = [1.57, 0.0, 0.0], [0.0, 0.0, 0.0]


@pytest.fixture(scope="module")
def check(tmp_path_factory: pytest.TempPathFactory) -> MotionCheck:
    """A check for the small arm with its finger held."""
    return MotionCheck(small_arm(tmp_path_factory.mktemp("robot"), "torques = [60, 30, inf]\n[held]\ngrip = 0.0\n"))


def refusal(check: MotionCheck, *motion: list[float], duration: float = 1.0, **asked: bool) -> MotionError:
    with pytest.raises(MotionError) as caught:
        check.check(straight(*motion, duration=duration), duration, **asked)
    return caught.value


def test_a_free_motion_has_its_smallest_clearance_and_torque_use(check: MotionCheck):
    found = check.check(straight(NORTH, [1.0, 0.3, 0.0]), 1.0)
    assert found.scope == "all"
    assert found.nearest is not None
    assert found.torque_use is not None
    assert 0 < found.torque_use[0] < 1
    assert np.isnan(found.torque_use[2]), "no limit"
    far = check.check(straight(NORTH, EAST), 1.0)
    assert far.nearest is not None
    assert (far.nearest.body, far.nearest.other) == ("finger", "wall")
    assert far.nearest.distance == pytest.approx(1.9 - 1.82, abs=2e-3)


def test_a_self_collision_is_reported_at_its_first_instant(check: MotionCheck):
    """The hand, of radius 0.04 m and 0.7 m from the elbow, approaches the upper arm, of radius 0.05 m."""
    found = refusal(check, NORTH, [1.57, 3.1, 0.0])
    assert isinstance(found, Collides)
    assert (found.body, found.other) == ("hand", "upper")
    angles = straight(NORTH, [1.57, 3.1, 0.0]).sample(np.array([found.time - 0.002, found.time])).positions[:, 1]
    before, at = (0.7 * np.sin(np.pi - angle) - 0.09 for angle in angles)
    assert at < 0.01 <= before
    assert found.distance == pytest.approx(0.7 * np.sin(np.pi - 3.1) - 0.09, abs=1e-3)
    assert "0.061 m deep into upper" in str(found)


def test_bodies_near_each_other_at_the_start_may_only_separate(check: MotionCheck):
    inside = [1.57, 3.09, 0.0]
    assert check.check(straight(inside, [1.57, 1.0, 0.0]), 1.0).scope == "all"
    assert isinstance(refusal(check, inside, [1.57, 3.1, 0.0]), Collides)


def test_a_fast_motion_is_checked_at_finer_steps(tmp_path: Path):
    """At 118 rad/s the finger is within the margin for 1.2 ms, less than the usual step of 2 ms."""
    careful = MotionCheck(small_arm(tmp_path, "[collision]\nmargin = 0.085\n"))
    found = refusal(careful, NORTH, [-1.57, 0.0, 0.0], duration=0.05, torque=False)
    assert isinstance(found, Collides)
    assert (found.body, found.time) == ("finger", pytest.approx(0.025, abs=0.001))


def test_an_excessive_torque_is_refused_with_joint_and_time(check: MotionCheck):
    """The stretched arm's inertia about the vertical axis is about 2.4 kg·m²."""
    found = refusal(check, NORTH, [2.9, 0.0, 0.0], duration=0.4)
    assert isinstance(found, TorqueExceeded)
    assert (found.joint, found.bound) == (0, 60.0)
    assert found.value == pytest.approx(2.4 * 5.77 * 1.33 / 0.4**2, rel=0.05)
    assert found.time < 0.1
    assert check.check(straight(NORTH, [2.9, 0.0, 0.0], 0.4), 0.4, torque=False).torque_use is None


def test_checks_can_be_disabled(check: MotionCheck):
    motion = straight(NORTH, [1.57, 3.1, 0.0])
    found = check.check(motion, 1.0, collision=False)
    assert (found.scope, found.nearest) == ("all", None)
    assert check.check(motion, 1.0, collision=False, torque=False).scope == "none"
