"""Two arms of one scene that move at the same time: a motion is checked against where the other arm will be."""

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
"""Each arm meets the other only where the left one is away while the right one is at home."""


@pytest.fixture(scope="module")
def check() -> MotionCheck:
    return MotionCheck(LEFT)


def planned(begin: float, start: np.ndarray, end: np.ndarray, duration: float = 1.0) -> PlannedMotion:
    """A motion as it is published, in samples of 1 ms."""
    return PlannedMotion(begin, 1e-3, straight(start, end, duration).sample(np.arange(0, duration + 5e-4, 1e-3)))


def scope(check: MotionCheck, other: OtherMotion, start: np.ndarray, end: np.ndarray, begin: float | None = 0.0) -> str:
    check.clearance.surround(LEFT.others["right"], other.positions.tolist())
    check.others = (other,)
    return check.check(straight(start, end), 1.0, begin=begin).scope


def test_crossing_plans_are_refused_though_both_starts_are_clear(check: MotionCheck):
    comes_home = OtherMotion(AWAY, [planned(7.2, AWAY, HOME)])
    assert scope(check, comes_home, HOME, AWAY, None) == "all", "the right arm stands away"
    with pytest.raises(Collides, match=r"begin after 8\.200 s, when the other robot's motion has ended") as caught:
        scope(check, comes_home, HOME, AWAY, 7.0)
    assert {body.partition("/")[0] for body in (caught.value.body, caught.value.other)} == {"left", "right"}
    # The first instant nearer than the margin, by a replay of both.
    times = np.arange(0, 1.2, 1e-3)
    both = np.hstack([straight(HOME, AWAY).sample(times).positions, comes_home.sample(7.0 + times)[0]])
    near = [_nearest(check, pose) < LEFT.collision.margin for pose in both[int(caught.value.time * 1e3) - 2 :]]
    assert near.index(True) in (0, 1, 2, 3)
    assert not any(_nearest(check, pose) < LEFT.collision.margin for pose in both[: int(caught.value.time * 1e3) - 2])


def _nearest(check: MotionCheck, pose: np.ndarray) -> float:
    check.clearance.place(pose)
    return min(check.clearance.distance(pair) for pair in range(len(check.clearance.pairs)))


def test_what_comes_after_the_own_end_counts(check: MotionCheck):
    with pytest.raises(Collides) as caught:
        scope(check, OtherMotion(AWAY, [planned(5.0, AWAY, HOME)]), HOME, AWAY)
    assert caught.value.time > 5


def test_one_arm_follows_the_other(check: MotionCheck):
    """What the right arm has left is free for the left one, but not before."""
    leaves = OtherMotion(HOME, [planned(3.0, HOME, AWAY)])
    assert scope(check, leaves, HOME, AWAY, 3.3) == "all"
    with pytest.raises(Collides):
        scope(check, leaves, HOME, AWAY, 2.0)


def test_a_later_plan_replaces_an_earlier_one(check: MotionCheck):
    corrected = OtherMotion(AWAY, [planned(0.0, AWAY, HOME, 2.0), planned(0.2, AWAY, AWAY)])
    assert scope(check, corrected, HOME, AWAY) == "all"
    assert corrected.until == pytest.approx(1.2)


def test_samples_between_and_around():
    ramp = np.array([[0.0], [1.0], [1.0]])
    motion = OtherMotion(np.array([-1.0]), [PlannedMotion(2.0, 0.5, Samples(ramp, ramp, ramp))])
    assert motion.sample(np.array([0.0, 2.0, 2.25, 2.75, 9.0]))[0, :, 0] == pytest.approx([-1, 0, 0.5, 1, 1])
    assert OtherMotion(np.zeros(1)).until == -np.inf
