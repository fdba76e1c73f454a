"""Joint velocities for a tool velocity, and refusals of velocities that the joints cannot reach."""

import numpy as np
import pytest

from robot.tool_velocities import joint_velocities

LIMITS = np.array([2.0, 2.0])


@pytest.mark.parametrize(
    ("smallest", "sentence"),
    [(0.5, "; 0.50 of that velocity works"), (1e-3, "; the arm is nearly stretched out: give it another place")],
)
def test_a_tool_velocity_that_is_too_fast_is_refused_with_a_remedy(smallest: float, sentence: str):
    refused = joint_velocities(np.diag([1.0, smallest]), np.array([0.0, 2.0]), LIMITS, ["a", "b"])
    assert isinstance(refused, str)
    assert "of b, whose limit is 2 rad/s" in refused
    assert refused.endswith(sentence)
