"""The arm's kinematics for striking, vectorised."""

import numpy as np
import pytest

from robot.description import load_robot
from robot.kinematics import Kinematics
from robot.striking.chain import Chain


def test_vectorised_kinematics_agree_with_mujocos():
    config = load_robot()
    postures = np.random.default_rng(0).uniform(*config.limits.positions.T, size=(20, 6))
    positions, normals, by_joints = Chain(config).jacobians(postures)
    own = Kinematics(config)
    for k, posture in enumerate(postures):
        place, turn = own.tool_pose(posture)
        assert positions[k] == pytest.approx(place, abs=1e-9)
        assert normals[k] == pytest.approx(turn[:, 2], abs=1e-9)
        speeds = np.arange(6.0)
        assert by_joints[k, :3] @ speeds == pytest.approx(own.tool_velocity(posture, speeds), abs=1e-9)
