"""A stub robot, and a client that is connected to it."""

from collections.abc import Iterator

import pytest

from client import Arm, connect
from tests.stub import Stub, robot, router

__all__ = ["arm", "robot", "router"]


@pytest.fixture
def arm(robot: Stub) -> Iterator[Arm]:
    with connect(robot.endpoint) as arm:
        yield arm
