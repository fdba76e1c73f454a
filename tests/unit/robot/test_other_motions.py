"""Two arms of one scene in motion: a motion is checked against the predicted positions of the other arm."""

import numpy as np
import pytest

from motion.trajectory import Samples
from robot.description import load_robot
from robot.motion_check import Collides, MotionCheck
from robot.other_motions import OtherMotion, PlannedMotion
from robot.shipped import DEFAULT_ROBOT_CONFIG
from tests.unit.robot.small_arm import straight

LEFT = load_robot(DEFAULT_ROBOT_CONFIG.with_name("left.toml"))
HOME = LEFT.home
AWAY = HOME + np.array([0.8, 0, 0, 0, 0, 0])
"""The arms collide only if the left one is at AWAY while the right one is at HOME."""


@pytest.fixture(scope="module")
def check() -> MotionCheck:
    return MotionCheck(LEFT)


def planned(begin: float, start: np.ndarray, end: np.ndarray, duration: float = 1.0) -> PlannedMotion:
    """Return a straight motion as it is published, in samples of 1 ms."""
    return PlannedMotion(begin, 1e-3, straight(start, end, duration).sample(np.arange(0, duration + 5e-4, 1e-3)))


def checked_scope(
    check: MotionCheck, other: OtherMotion, start: np.ndarray, end: np.ndarray, begin: float | None = 0.0
) -> str:
    check.clearance.surround(LEFT.others["right"], other.positions.tolist())
    check.others = (other,)
    return check.check(straight(start, end), 1.0, begin=begin).scope


def test_a_plan_that_crosses_the_other_arms_motion_is_refused(check: MotionCheck):
    comes_home = OtherMotion(AWAY, [planned(7.2, AWAY, HOME)])
    assert checked_scope(check, comes_home, HOME, AWAY, None) == "all", "the right arm is at AWAY until 7.2 s"
    with pytest.raises(Collides, match=r"begin after 8\.200 s, when the other robot's motion has ended") as caught:
        checked_scope(check, comes_home, HOME, AWAY, 7.0)
    assert {body.partition("/")[0] for body in (caught.value.body, caught.value.other)} == {"left", "right"}
    # The first instant within the margin, by a replay of both motions.
    times = np.arange(0, 1.2, 1e-3)
    both = np.hstack([straight(HOME, AWAY).sample(times).positions, comes_home.sample(7.0 + times)[0]])
    near = [_nearest(check, pose) < LEFT.collision.margin for pose in both[int(caught.value.time * 1e3) - 2 :]]
    assert near.index(True) in (0, 1, 2, 3)
    assert not any(_nearest(check, pose) < LEFT.collision.margin for pose in both[: int(caught.value.time * 1e3) - 2])


def _nearest(check: MotionCheck, pose: np.ndarray) -> float:
    check.clearance.place(pose)
    return min(check.clearance.distance(pair) for pair in range(len(check.clearance.pairs)))


def test_the_other_arms_motion_is_checked_beyond_the_end_of_the_own_motion(check: MotionCheck):
    with pytest.raises(Collides) as caught:
        checked_scope(check, OtherMotion(AWAY, [planned(5.0, AWAY, HOME)]), HOME, AWAY)
    assert caught.value.time > 5


def test_space_that_the_other_arm_has_left_is_free(check: MotionCheck):
    leaves = OtherMotion(HOME, [planned(3.0, HOME, AWAY)])
    assert checked_scope(check, leaves, HOME, AWAY, 3.3) == "all"
    with pytest.raises(Collides):
        checked_scope(check, leaves, HOME, AWAY, 2.0)


def test_a_later_plan_replaces_the_rest_of_an_earlier_one(check: MotionCheck):
    corrected = OtherMotion(AWAY, [planned(0.0, AWAY, HOME, 2.0), planned(0.2, AWAY, AWAY)])
    assert checked_scope(check, corrected, HOME, AWAY) == "all"
    assert corrected.until == pytest.approx(1.2)


def test_samples_are_interpolated_and_held_outside_the_motion():
    ramp = np.array([[0.0], [1.0], [1.0]])
    motion = OtherMotion(np.array([-1.0]), [PlannedMotion(2.0, 0.5, Samples(ramp, ramp, ramp))])
    assert motion.sample(np.array([0.0, 2.0, 2.25, 2.75, 9.0]))[0, :, 0] == pytest.approx([-1, 0, 0.5, 1, 1])
    assert OtherMotion(np.zeros(1)).until == -np.inf
