"""Collision checks on random motions of other projects' arms."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.space import compare
from robot.clearance import ROUGH, Clearance
from robot.description import load_robot
from tests import arms


def test_no_collision_is_missed_and_nothing_clear_is_refused(tmp_path: Path):
    """A small version of `python -m benchmarks.space`, with torque limits that refuse some plans too."""
    file = arms.UR5E.write(tmp_path)
    file.write_text(file.read_text() + "torques = [60, 60, 30, 5, 5, 5]\n")
    found = compare(load_robot(file), 50, seed=1)
    assert found.missed == found.wrong == 0
    assert found.free > 10
    assert found.collisions > 5
    assert found.torques > 1
    assert found.deepest < 1e-3
    assert found.overestimated < 5e-3


def test_a_distance_beyond_the_rough_one_is_a_lower_bound():
    """On the shipped arm, which stays farther than that from everything in most motions."""
    found = compare(load_robot(), 60, seed=3)
    assert found.free > 50
    assert found.overestimated < 5e-3


@pytest.mark.parametrize("arm", [arms.UR5E, arms.PANDA, arms.IIWA14], ids=["ur5e", "panda", "iiwa14"])
def test_distances_change_no_faster_than_their_rates(arm: arms.Arm, tmp_path: Path):
    config = load_robot(arm.write(tmp_path))
    clearance = Clearance(config, config.load_model())
    rng = np.random.default_rng(2)
    ranges = np.clip(config.limits.positions, -np.pi, np.pi).T
    checked, largest = 0, 0.0
    for _ in range(60):
        pose = rng.uniform(*ranges)
        moved = rng.normal(0, 0.02, config.joint_count)
        before, after = (_distances(clearance, positions) for positions in (pose, pose + moved))
        exact = (before < ROUGH) & (after < ROUGH) & (before > 0) & (after > 0)
        change = np.abs(after - before)[exact]
        bound = (clearance.rates @ np.abs(moved))[exact]
        assert np.all(change <= bound + 1e-5)
        checked += exact.sum()
        largest = max(largest, (change / bound).max(initial=0.0))
    assert checked > 100
    assert largest > 0.3, "the bounds are never nearly reached, which costs time"


def _distances(clearance: Clearance, positions: np.ndarray) -> np.ndarray:
    clearance.place(positions)
    return np.array([clearance.distance(pair) for pair in range(len(clearance.pairs))])
