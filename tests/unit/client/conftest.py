"""The stub that the client's tests speak to, and a client of it."""

from collections.abc import Iterator

import pytest

from client import Arm, connect
from tests.stub import Stub, robot, router

__all__ = ["arm", "robot", "router"]


@pytest.fixture
def arm(robot: Stub) -> Iterator[Arm]:
    with connect(robot.endpoint) as arm:
        yield arm
