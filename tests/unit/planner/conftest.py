"""A movement that is planned."""

import numpy as np
import pytest

from motion.demonstration import Demonstration
from motion.primitive import Primitive, learn
from tests.unit.planner.goal_requests import JOINTS


@pytest.fixture(scope="module")
def primitive() -> Primitive:
    """A movement of all joints in 0.7334 s."""
    times = np.linspace(0.0, 0.7334, 200)
    return learn(Demonstration(times, np.sin(np.outer(times, np.linspace(1.0, 2.0, JOINTS)))))
